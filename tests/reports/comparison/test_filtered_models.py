"""Curves of a report beside a record that was filtered: every one passes the record's filter."""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from birdstrike.inversion.observations.filters import ModelFilter
from birdstrike.reports.comparison.models import run_models
from birdstrike.reports.results.reading import read_results
from tests.reports.synthetic import stand_in_for_models

PASSED = ModelFilter("CFC600", 2.6e-3, 1e-5)


@pytest.fixture
def loop(finished: Path, tmp_path: Path) -> Path:
    """A loop whose inversion had a filter."""
    for part in ("doe", "inversion"):
        shutil.copytree(finished / part, tmp_path / part)
    path = tmp_path / "inversion" / "options.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {"filters": [asdict(PASSED)]}))
    return tmp_path


def test_models_verification_and_campaign_pass_the_record_s_filter(
    finished: Path, loop: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in_for_models(monkeypatch)
    plain, passed = run_models(read_results(finished)), run_models(read_results(loop))
    channel = plain.channels[0]
    pairs = [(plain.models[key].run, passed.models[key].run) for key in plain.models]
    pairs += [(plain.verified[key], passed.verified[key]) for key in plain.verified]
    assert len(pairs) >= 5
    for before, after in pairs:
        assert before is not None
        assert after is not None
        expected = PASSED.curves(before.time, before.channels[channel])
        np.testing.assert_allclose(after.channels[channel], expected, rtol=0.0, atol=1e-12)
        assert np.abs(expected - before.channels[channel]).max() > 1e-5
    curves = PASSED.curves(plain.dataset.time, plain.dataset.curves[channel])
    np.testing.assert_allclose(passed.dataset.curves[channel], curves, rtol=0.0, atol=1e-12)
    assert passed.filter_text == "The simulated curves have passed CFC600, as the record has."
    assert plain.filter_text == ""
