"""Numba kernels: loops over particles, elements and nodes, on arrays and scalars; outputs last, written in place.

A bird of particles: neighbours, columns, smoothing, velocity_gradient, null_material or solid_material (about a law,
see eos), sph, sph_strength; total_lagrangian with neo_hookean for the elastic one. Of hexahedra: hexahedra,
hexahedra_stress, hexahedra_hourglass. Strength at a point: strength. The plate: shell_geometry, shell, shell_stress
with plasticity, shell_erosion, plate_edges, plate_motion. Between them: contact, friction. For all: motion, sums; for
sensors: gauge.
"""
