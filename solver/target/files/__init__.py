"""Meshes from files: a file and its unit of length enter, a `PartMesh` in SI and what is found about its shells leave.

Read mesh_file, then text_mesh and one of the formats (abaqus_mesh, lsdyna_mesh, nastran_mesh), then mesh_quality
(faults and warnings).
"""
