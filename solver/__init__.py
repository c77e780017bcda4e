"""The embedded explicit solver: a bird against a deformable or rigid plate.

A case (`case/`, and `effects/` for what is stated relative to it) enters, `data.histories.Histories` leave. Read
simulate, the time loop; coupling, one step of it; build, which makes `bird/` and `plate/` from the case; contact,
energy_balance and checks; `sensors/`, what is recorded. Loops over particles and elements are in `kernels/`, analytic
solutions to verify against in `reference/`.
"""

from birdstrike.solver.cpu_features import use_full_vectors, wait_briefly
from birdstrike.solver.kernel_cache import forget_stale_kernels

# Before any kernel compiles or runs, and the same in every process: the cache of compiled code is keyed by the target.
use_full_vectors()
wait_briefly()
forget_stale_kernels()
