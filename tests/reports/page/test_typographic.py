"""Numbers in the sentences of a page have the signs of its figures; what is to be typed stays as it is typed."""

from __future__ import annotations

import pytest

from birdstrike.reports.template import typographic


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("-0.5 mm (95 %: -0.6 .. -0.4 mm)", "−0.5 mm (95 %: −0.6 .. −0.4 mm)"),
        ("-", "–"),
        ("at most +-3 points", "at most ±3 points"),
        ("more than 5% of the mass", "more than 5 % of the mass"),
        ('import it with --shift "-0.3 ms"', 'import it with --shift "-0.3 ms"'),
        ("birdstrike import x.csv --scale w=-1 --shift -3", "birdstrike import x.csv --scale w=-1 --shift -3"),
        ("shot-7 of 2026-11-29, error 1e-15", "shot-7 of 2026-11-29, error 1e-15"),
    ],
)
def test_signs_of_numbers_are_typographic(text: str, shown: str) -> None:
    assert typographic(text) == shown
