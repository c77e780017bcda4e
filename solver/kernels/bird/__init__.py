"""The bird: particles or hexahedra in, stresses, forces and energies out.

Particles: neighbours (pairs by columns), smoothing (the kernel function), velocity_gradient, null_material or
solid_material (about an equation of state: eos; strength at a point: strength), sph and sph_strength (forces);
total_lagrangian with neo_hookean for the elastic bird. Hexahedra: hexahedra, hexahedra_stress, hexahedra_hourglass.
"""
