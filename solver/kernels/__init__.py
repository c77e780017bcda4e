"""Numba kernels: functions on arrays and scalars, outputs last, written in place."""
