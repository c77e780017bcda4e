"""The commands that make results again, from what is stored beside them."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from birdstrike.data.storage.files import read_json
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.inversion.results.diagnosis_files import RESULT, baseline_file, case_files
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.inversion.train_and_invert import OPTIONS_FILE
from birdstrike.reports.results.results import Results

AGAIN = "AGAIN"
"""The folder that the commands fill."""


@dataclass(frozen=True)
class Command:
    """words: of the command line, empty where none can be given; notes: what it does not repeat."""

    made: str
    words: tuple[str, ...]
    notes: tuple[str, ...] = ()

    @property
    def line(self) -> str:
        """The command as a shell takes it, and what it does not repeat."""
        return "; ".join([*([shlex.join(self.words)] if self.words else []), *self.notes])


def commands(results: Results) -> tuple[Command, ...]:
    """Those of the campaign, the inversion and, where there is one, the diagnosis, in the order in which they run."""
    found = (_campaign(results), _inversion(results))
    return found if results.diagnosis is None else (*found, diagnosis_command(results.diagnosis))


def stored_options(inversion: Path, answer: Inversion) -> tuple[dict[str, Any], list[str]]:
    """The options of train-and-invert; of a folder of an older version those that inversion.json tells, and a note."""
    path = inversion / OPTIONS_FILE
    if path.is_file():
        return read_json(path), []
    methods = list(answer.methods)
    known = {
        "trainer": answer.training.trainer if answer.training is not None else "lm",
        "method": "both" if len(methods) > 1 else methods[0],
        "seed": answer.seed,
        "allow_rank_deficient": any(one.combination is not None for one in answer.methods.values()),
        "campaigns": [],
        "forward": None,
        "measured": list(answer.records),
        "cases": [None] * len(answer.records),
        "extras": {"refine": len(answer.refinement.added) if answer.refinement is not None else 0},
    }
    line = (
        f"{OPTIONS_FILE} is not there: the folder is of an older version, and the command is made from inversion.json"
    )
    return known, [f"{line}; what it does not tell is at its default"]


def invert_words(
    options: Mapping[str, Any],
    campaigns: Iterable[str],
    records: Iterable[str],
    cases: Iterable[str],
    mesh: str,
    out: str,
) -> list[str]:
    """Arguments of birdstrike for the inversion with these options; mesh: the mesh study's file, where one was used."""
    extras = options["extras"]
    words = ["train-and-invert", *campaigns, *_repeated("--measured", records), *_repeated("--case", cases)]
    words += ["--out", out, "--trainer", options["trainer"], "--method", options["method"]]
    words += ["--seed", str(options["seed"]), "--refine", str(extras.get("refine", 0))]
    if "hidden" in extras:
        words += ["--hidden", "search" if extras["hidden"] is None else str(extras["hidden"])]
    for name in ("copies", "outputs", "discrepancy", "filter", "filtered"):
        unset = "bounded" if name == "outputs" else None
        if extras.get(name, unset) != unset:
            words += [f"--{name}", str(extras[name])]
    words += ["--mesh", mesh] if extras.get("mesh") else []
    words += ["--mesh-correction"] if extras.get("mesh_correction") else []
    words += ["--no-posterior"] if extras.get("posterior") is False else []
    words += ["--channels", ",".join(extras["channels"])] if extras.get("channels") else []
    words += ["--allow-rank-deficient"] if options["allow_rank_deficient"] else []
    return words


def _campaign(results: Results) -> Command:
    """Of the folder's own copy of the case. A design from a file is run whole."""
    design = results.campaign["design"]
    words = ["birdstrike", "run-doe", str(results.doe / "case.toml"), "--out", f"{AGAIN}/doe"]
    words += ["--design", str(design["source"] or design["kind"])]
    first, *further = design.get("calls", [design["runs"]])
    words += [] if design["source"] else ["--runs", str(first), "--seed", str(design["seed"] or 0)]
    then = [] if design["source"] else [f"then the same with --runs {runs}" for runs in further]
    return Command("campaign", tuple(words), tuple(then))


def _inversion(results: Results) -> Command:
    """With the new campaign where there was one, with those that were given where there were several."""
    options, notes = stored_options(results.inverted, results.inversion)
    several = len(options["campaigns"]) > 1
    if unknown := _unknown(options, several):
        return Command("inversion", (), (*notes, f"no command repeats the inversion: {unknown}"))
    words = invert_words(
        options,
        options["campaigns"] if several else [f"{AGAIN}/doe"],
        options["measured"],
        options["cases"] if all(options["cases"]) else [],
        str(options["extras"].get("mesh")),
        f"{AGAIN}/inversion",
    )
    return Command("inversion", ("birdstrike", *words), tuple(notes))


def _unknown(options: Mapping[str, Any], several: bool) -> str:
    """Why no command can be given; "" where one can."""
    if why := verified_in_python(options):
        return why
    if not all(options["measured"]):
        return "a record was handed over in Python and had no file"
    if several and not all(options["cases"]):
        return "a case of one of its campaigns was handed over in Python and had no file"
    return ""


def verified_in_python(options: Mapping[str, Any]) -> str:
    """Says that a function stood in the solver's place, where one did: a command would ask the solver."""
    return f"verified by a function in Python ({options['forward']})" if options.get("forward") else ""


def diagnosis_command(folder: Path) -> Command:
    """Of a diagnosis, with the cases that its folder holds; raises UserError for a damaged diagnosis.json."""
    found = Diagnosis.read(folder / RESULT)
    told = found.options
    if told is None:
        note = "no command can be given: the diagnosis is of an earlier version, which did not store its options"
        return Command("diagnosis", (), (note,))
    shots, clean = found.record["shots"], told["baselines"]
    records = found.record["files"][: len(shots)]
    if not all([*records, *clean.values(), told["heldout"] is None or told["heldout"]]):
        return Command(
            "diagnosis", (), ("no command can be given: a record was handed over in Python and had no file",)
        )
    cases = [str(folder / name) for name in case_files(shots)]
    words = ["birdstrike", "diagnose", cases[0], *_repeated("--measured", records), *_repeated("--case", cases[1:])]
    words += _repeated("--baseline", clean.values())
    words += _repeated("--baseline-case", [str(folder / baseline_file(name)) for name in clean])
    words += ["--baseline-bird", told["baseline_bird"]] if clean or len(shots) > 1 else []
    words += ["--heldout", told["heldout"]] if told["heldout"] else []
    words += ["--channels", ",".join(told["channels"])] if told["channels"] else []
    words += ["--alpha", str(found.alpha), "--refine", str(told["refine"]), "--seed", str(told["seed"])]
    words += ["--out", f"{AGAIN}/diagnosis"]
    unsaid = [f"{name} = {value}" for name, value in told["python"].items()]
    return Command("diagnosis", tuple(words), (f"what Python alone can set: {', '.join(unsaid)}",) if unsaid else ())


def _repeated(option: str, values: Iterable[str]) -> list[str]:
    return [word for value in values for word in (option, str(value))]
