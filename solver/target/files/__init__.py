"""Meshes from files: a file and its unit of length enter, a `PartMesh` in SI and what is found about its shells leave.

Read mesh_file, then lsdyna_mesh and text_meshes (what the formats give), then mesh_quality (faults and warnings).
"""
