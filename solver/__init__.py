"""The embedded explicit solver: a bird against a deformable or rigid target.

A case (`case/`, and `effects/` for what is stated relative to it) enters, `data.histories.Histories` leave. Read
simulate, the time loop; coupling, one step of it; build, which makes `bird/` and `target/` from the case; contact,
energy_balance and checks; `sensors/`, what is recorded. Loops over particles and elements are in `kernels/`, analytic
solutions to verify against in `reference/`.
"""

from birdstrike.solver.compilation import forget_stale_kernels, use_full_vectors, wait_briefly

# Before any kernel compiles or runs, and the same in every process: the cache of compiled code is keyed by the target.
use_full_vectors()
wait_briefly()
forget_stale_kernels()
