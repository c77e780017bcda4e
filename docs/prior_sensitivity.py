"""How answers of the diagnosis turn with the scales of its priors: figures of docs/limits.md.

python docs/prior_sensitivity.py CASE SHOT.csv [SHOT.csv ...] [--baseline SHOT0.csv] --out FOLDER

Every shot is diagnosed as it is and with each scale changed by a factor of 2 either way: the size of the magnitudes'
prior, that of a shot's own part of the model error, and the distance in parameters over which the model error changes.
FOLDER keeps the simulations, which all diagnoses share, and every answer (answers.json): the same call resumes. It is
no part of the repository.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from concurrent.futures import as_completed
from dataclasses import replace
from pathlib import Path
from typing import Any

from birdstrike.data.storage.files import write_json
from birdstrike.doe.campaign.worker import process_pool, worker_count
from birdstrike.inversion.diagnosis.diagnose import DiagnosisOptions, diagnose
from birdstrike.inversion.results.diagnosis import NO_RESIDUAL, NONE, SOMETHING_ELSE

SCALES = ("magnitude_scale", "remainder_scale", "parameter_length")
FACTORS = (0.5, 2.0)
VARIANTS: Mapping[str, Mapping[str, float]] = {
    "as it is": {},
    **{f"{name} x {factor:g}": {name: factor} for name in SCALES for factor in FACTORS},
}


def answer(
    case: str, shot: str, baseline: str | None, out: Path, variant: str, workers: int | None = 1
) -> dict[str, Any]:
    """What a variant says of a shot; workers: simulations at a time, all cores for None."""
    options = replace(DiagnosisOptions(workers=workers, check=False), **VARIANTS[variant])
    found = diagnose(case, shot, out, options=options, baseline=() if baseline is None else (baseline,))
    best = next(one for one in found.effects if one.name not in (NONE, SOMETHING_ELSE))
    return {
        "alarm": found.alarm,
        "verdict": found.verdict,
        "set": found.confidence_set,
        "best": best.name,
        "probability": best.probability,
        "magnitude": best.magnitude,
        "interval": best.interval_95,
    }


def line(shot: str, found: Mapping[str, Mapping[str, Any]]) -> str:
    """One row of the table: verdict, likeliest effect with its magnitude, members of the set."""
    cells = []
    for variant in VARIANTS:
        one = found[variant]
        size = f"{one['best']} {one['magnitude']:.3g}" if one["verdict"] != NO_RESIDUAL else ""
        cells.append(f"{one['verdict'].replace('_', ' ')} {size} ({len(one['set'])} in the set)".replace("  ", " "))
    return f"| {shot} | {' | '.join(cells)} |"


def main() -> None:
    """Diagnose, and print the table."""
    given = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    given.add_argument("case")
    given.add_argument("shots", nargs="+")
    given.add_argument("--baseline")
    given.add_argument("--out", type=Path, required=True)
    words = given.parse_args()
    path = words.out / "answers.json"
    known: dict[str, dict[str, Any]] = json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}
    due = [(shot, variant) for shot in words.shots for variant in VARIANTS if variant not in known.get(shot, {})]

    def keep(shot: str, variant: str, found: dict[str, Any]) -> None:
        known.setdefault(shot, {})[variant] = found
        write_json(path, known)
        sys.stdout.write(f"{shot} {variant}: {found}\n")

    if due:  # alone: it makes the simulations that the others share
        shot, variant = due.pop(0)
        keep(shot, variant, answer(words.case, shot, words.baseline, words.out, variant, None))
    with process_pool(worker_count(None)) as pool:
        sent = {pool.submit(answer, words.case, one[0], words.baseline, words.out, one[1]): one for one in due}
        for future in as_completed(sent):
            keep(*sent[future], future.result())
    sys.stdout.write(f"| shot | {' | '.join(VARIANTS)} |\n|{'---|' * (len(VARIANTS) + 1)}\n")
    for shot in words.shots:
        sys.stdout.write(f"{line(Path(shot).stem, known[shot])}\n")


if __name__ == "__main__":
    main()
