"""Meshes from files: a file and its unit of length enter, a `PartMesh` in SI and what is found about its shells leave.

Read mesh_file, then lsdyna_mesh and element_numbers (what the formats give), then mesh_quality (faults and warnings).
"""
