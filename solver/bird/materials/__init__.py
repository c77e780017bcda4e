"""Materials of the bird: one file a kind, each with its table in a case, its rules and what it builds.

A table (`interface.BirdMaterial`) and the reference density enter; what the bodies step leaves: a `fluid.Fluid` or a
`solid.Solid`. Read interface, fluid and solid, then any kind, then registry.
"""
