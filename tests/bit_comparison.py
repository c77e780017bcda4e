"""Whether the histories of this tree are, bit for bit, those of the commit whose numbers were verified.

Compiled code depends on the processor, on numba and on LLVM, so the comparison runs both trees on one machine. The
digests of one machine are kept beside this file; `test_bit_comparison.py` holds the small cases to them where processor
and versions are the same.
"""

from __future__ import annotations

import argparse
import dataclasses
import hashlib
import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

BASE_COMMIT = "05cef80"
HERE = Path(__file__).resolve()
TREE = HERE.parents[1]
DIGESTS = HERE.with_name("bit_digests.json")

SMALL = {"bird.particles": "300", "plate.elements": "[12, 10]", "time.end": "0.8 ms", "time.snapshots": '["0.8 ms"]'}
SENSORS = {
    "sensors.deflection.kind": "displacement",
    "sensors.deflection.at": '["40 mm", "-30 mm"]',
    "sensors.gauge.kind": "strain",
    "sensors.gauge.direction": "30 deg",
    "sensors.gauge.side": "back",
    "sensors.gauge.length": "20 mm",
    "sensors.gauge.at": '["20 mm", "10 mm"]',
    "sensors.frame.kind": "reaction_force",
    "sensors.contact.kind": "contact_force",
    "sensors.face.kind": "pressure",
    "sensors.face.radius": "60 mm",
}
EVERY_INSTRUMENT_KEY = {
    f"instrument.{name}.{key}": text
    for name, drift in (("deflection", "0.1 mm/s"), ("gauge", "0.01 1/s"), ("frame", "10 kN/s"), ("face", "1 MPa/s"))
    for key, text in (("time_offset", "0.02 ms"), ("gain", "1.03"), ("bandwidth", "5 kHz"), ("drift", drift))
}
POROUS = {"bird.material.eos.kind": "porous", "bird.material.eos.z": "0.1", "bird.material.eos.mixing": "wood"}
TEARING = SMALL | {
    "bird.particles": "500",
    "plate.elements": "[20, 16]",
    "plate.thickness": "1.5 mm",
    "plate.material.failure_strain": "0.01",
    "impact.speed": "120 m/s",
    "impact.angle": "90 deg",
    "impact.friction": "0.2",
}
CASES: dict[str, tuple[str, dict[str, str]]] = {
    "reference_strike": ("reference_strike", {}),
    "openradioss_viscous": ("openradioss_viscous", {}),
    "hexahedral": ("reference_strike", SMALL | {"bird.method": "hexahedra"}),
    "porous": ("reference_strike", SMALL | POROUS),
    "tearing": ("reference_strike_156mm", TEARING),
    "rigid": ("reference_strike", SMALL | {"plate.rigid": "true"}),
    "instruments": ("reference_strike", SMALL | SENSORS | EVERY_INSTRUMENT_KEY),
    "elastic": ("reference_strike_elastic", SMALL),
    "plastic_kinematic": ("reference_strike_plastic_kinematic", SMALL),
    "hydrodynamic_hexahedral": ("reference_strike_hydrodynamic", SMALL | {"bird.method": "hexahedra"}),
}
LARGE = ("reference_strike", "openradioss_viscous")
"""Cases in their own size; all others are small."""

Digests = dict[str, dict[str, str]]
"""Case -> history -> digest of its bits."""


def machine() -> dict[str, str]:
    """What compiled code depends on."""
    import llvmlite.binding
    import numba
    import numpy as np

    features = llvmlite.binding.get_host_cpu_features().flatten()
    return {
        "processor": f"{llvmlite.binding.get_host_cpu_name()} {_digest([features.encode()])}",
        "numba": numba.__version__,
        "llvm": ".".join(str(part) for part in llvmlite.binding.llvm_version_info),
        "numpy": np.__version__,
    }


def digests_of(names: Iterable[str]) -> Digests:
    """Digests of cases, run in this process by the birdstrike that it imports."""
    from birdstrike import load_case, simulate

    found: Digests = {}
    for name in names:
        case, changes = CASES[name]
        run = simulate(load_case(case, changes))
        found[name] = {"time": _digest([run.time.tobytes()])}
        found[name] |= {channel: _digest([values.tobytes()]) for channel, values in run.channels.items()}
        fields = [_bytes(snapshot) for snapshot in run.snapshots]
        found[name]["snapshots"] = _digest(fields)
    return found


def _bytes(snapshot: Any) -> bytes:
    values = dataclasses.asdict(snapshot)
    return b"".join(
        value.tobytes() if hasattr(value, "tobytes") else repr(value).encode() for _, value in sorted(values.items())
    )


def _digest(parts: Iterable[bytes]) -> str:
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()[:16]


def in_tree(tree: Path, names: Iterable[str]) -> Digests:
    """Digests of cases, run in a process of its own by the birdstrike of a tree."""
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "digests.json"
        command = [sys.executable, "-P", str(HERE), "--digests-of", *names, "--expect", str(tree), "--out", str(out)]
        subprocess.run(command, cwd=scratch, env=os.environ | {"PYTHONPATH": str(tree)}, check=True)
        return json.loads(out.read_text())


def differences(before: Digests, after: Digests) -> list[str]:
    """Histories that are not the same, as "case: history"."""
    return [
        f"{case}: {history}"
        for case in before
        for history in sorted({*before[case], *after.get(case, {})})
        if before[case].get(history) != after.get(case, {}).get(history)
    ]


def kept() -> Mapping[str, Any]:
    """The digests beside this file and the machine that they belong to."""
    return json.loads(DIGESTS.read_text())


class BaseTree:
    """Worktree of the commit to compare with: the one given, or one that is made and removed again."""

    def __init__(self, given: Path | None) -> None:
        self.given = given
        self.made = None if given else tempfile.TemporaryDirectory()

    def __enter__(self) -> Path:
        if self.made is None:
            assert self.given is not None
            return self.given.resolve()
        tree = Path(self.made.name) / "base"
        subprocess.run(["git", "-C", str(TREE), "worktree", "add", "--detach", str(tree), BASE_COMMIT], check=True)
        return tree

    def __exit__(self, *_: object) -> None:
        if self.made is not None:
            tree = Path(self.made.name) / "base"
            subprocess.run(["git", "-C", str(TREE), "worktree", "remove", "--force", str(tree)], check=True)
            self.made.cleanup()


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--base", type=Path, help=f"existing worktree of {BASE_COMMIT}; default: one is made, removed")
    parser.add_argument("--cases", nargs="+", choices=CASES, default=list(CASES), help="default: all of them")
    parser.add_argument("--write", action="store_true", help=f"keep the digests of {BASE_COMMIT} in {DIGESTS.name}")
    parser.add_argument("--digests-of", nargs="+", choices=CASES, help=argparse.SUPPRESS)
    parser.add_argument("--expect", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--out", type=Path, help=argparse.SUPPRESS)
    return parser.parse_args()


def main() -> int:
    """0 where every bit is the same, 1 where one is not."""
    options = parsed()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that the worktree is removed
    if options.digests_of:
        import birdstrike

        assert options.expect in Path(birdstrike.__file__).parents, f"{birdstrike.__file__} is not of {options.expect}"
        options.out.write_text(json.dumps(digests_of(options.digests_of)))
        return 0
    with BaseTree(options.base) as base:
        before = in_tree(base, options.cases)
    if options.write:
        record = dict(kept()) if DIGESTS.exists() and kept()["machine"] == machine() else {"digests": {}}
        record = {"machine": machine(), "commit": BASE_COMMIT, "digests": record["digests"] | before}
        DIGESTS.write_text(json.dumps(record, indent=2) + "\n")
    wrong = differences(before, in_tree(TREE, options.cases))
    for line in wrong:
        print(f"differs from {BASE_COMMIT}: {line}")  # noqa: T201
    if not wrong:
        print(f"{', '.join(options.cases)}: every bit as at {BASE_COMMIT}")  # noqa: T201
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
