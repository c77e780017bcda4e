"""What follows from a ranking: alarm, verdict, the error before and after, and the measurement to take next.

Enters: a `Ranking` and its shots. Leaves: the parts of a `Diagnosis`. Read `baseline`, `solver_update`,
`alarm`, `next_measurement`, `before_and_after`, `answer`.
"""
