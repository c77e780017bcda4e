"""Numba kernels: loops over particles, elements and nodes, on arrays and scalars; outputs last, written in place.

bird/ and target/ move the two bodies, contact/ pushes them apart. Here lies what all use: motion of particles, sums in
a fixed order, and the gauge of a pressure sensor. A kernel imports numpy, numba and kernels.
"""
