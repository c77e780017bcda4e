"""Histories of small cases, bit for bit those of the commit whose numbers were verified (see bit_comparison.py)."""

from __future__ import annotations

import pytest

from tests.bit_comparison import CASES, LARGE, differences, digests_of, kept, machine


@pytest.mark.parametrize("name", [name for name in CASES if name not in LARGE])
def test_histories_are_bit_for_bit_those_of_the_verified_commit(name: str) -> None:
    record, here = kept(), machine()
    if record["machine"] != here:
        pytest.skip(f"the digests are of another machine: {record['machine']}, this is {here}")
    assert differences({name: record["digests"][name]}, digests_of([name])) == []
