"""Cases made ready for the audit: campaign, emulator, responses and numerical error, shared by their experiments."""

from __future__ import annotations

import hashlib
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path

from birdstrike.inversion.diagnosis.groundwork import Groundwork, prepare
from birdstrike.inversion.diagnosis.strikes import Strikes

from birdstrike.doe.campaign.campaign import run_campaign
from birdstrike.doe.designs.registry import make_design
from birdstrike.doe.designs.space import ParameterSpace
from birdstrike.inversion.audit.coarse import coarse
from birdstrike.inversion.diagnosis.diagnose import Study, Wishes
from birdstrike.solver.case.case import Case
from birdstrike.solver.case.write import case_toml

Key = tuple[str, tuple[str, ...]]


def digest(case: Case) -> str:
    """First 16 hex digits of SHA-256 of the case as a file without its name; what is calibrated and noise count."""
    return hashlib.sha256(case_toml(case).partition("\n")[2].encode()).hexdigest()[:16]


@dataclass
class Bench:
    """Cases made ready, by case and channels; the context `stack` keeps their strikes' workers."""

    out: Path
    wishes: Wishes
    studies: dict[Key, Study] = field(default_factory=dict)
    blunt: dict[int, Groundwork] = field(default_factory=dict)
    stack: ExitStack = field(default_factory=ExitStack)

    def study(self, case: Case, channels: tuple[str, ...]) -> Study:
        """The study of a case with these channels, its campaign and strikes run or found."""
        key = (digest(case), channels)
        if key not in self.studies:
            folder = self.out / key[0]
            design = make_design("uniform", ParameterSpace.of(case.parameters()), self.wishes.runs, self.wishes.seed)
            workers = self.wishes.workers
            with self.wishes.counter() as bar:
                dataset = run_campaign(
                    case,
                    design,
                    folder / "doe",
                    workers=workers,
                    progress=bar,
                    say=lambda _: None,
                    retry=self.wishes.retry,
                )
            bar = self.stack.enter_context(self.wishes.counter())
            retry = self.wishes.retry
            read = (folder / "doe" / "runs",)
            strikes = self.stack.enter_context(Strikes(folder / "runs", read, workers, bar, retry))
            self.studies[key] = Study(prepare(case, dataset, channels, strikes, lambda _: None), strikes, self.wishes)
        return self.studies[key]

    def coarse(self, study: Study) -> Groundwork:
        """The same with a coarse emulator."""
        if id(study) not in self.blunt:
            self.blunt[id(study)] = coarse(study.ground)
        return self.blunt[id(study)]
