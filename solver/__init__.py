"""The embedded explicit solver: an SPH bird against a deformable shell plate."""

from solver.target import use_full_vectors

use_full_vectors()  # before any kernel compiles, and the same in every process: the cache is keyed by it
