"""The embedded explicit solver: an SPH bird against a deformable shell plate."""

from birdstrike.solver.cpu_features import use_full_vectors, wait_politely

# Before any kernel compiles or runs, and the same in every process: the cache of compiled code is keyed by the target.
use_full_vectors()
wait_politely()
