"""Settings of the tests that draw random input: 12 examples each in `make test`, BIRDSTRIKE_FUZZ=n draws n."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

from hypothesis import HealthCheck, settings

EXAMPLES = int(os.environ.get("BIRDSTRIKE_FUZZ", "12"))

fuzzed: Callable[[Any], Any] = settings(
    max_examples=EXAMPLES,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[
        HealthCheck.too_slow,
        HealthCheck.data_too_large,
        HealthCheck.filter_too_much,
        HealthCheck.function_scoped_fixture,
    ],
)
