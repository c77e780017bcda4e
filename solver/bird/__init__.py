"""The bird: its shape, materials, and the particles or finite elements that carry them.

Points in place, velocities and a material enter; a body that the coupling steps (body.BirdBody) leaves. Read body, then
shape, `materials/` with `eos/`; particles: sph with neighbour_list, sph_strength, total_lagrangian; elements: hex_mesh,
hexahedra.
"""
