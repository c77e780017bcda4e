"""Meshes of targets from a few dimensions: one file a kind, each with its table in a case.

Dimensions enter, a `PartMesh` leaves. Read interface, stiffened_panel, registry.
"""
