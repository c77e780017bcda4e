"""Close the loop: campaign, inversion with its verification, diagnosis and report of one case and one record."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from birdstrike.data.arguments import as_list, as_names, as_path
from birdstrike.data.errors import UserError
from birdstrike.data.paths import resolve_measured
from birdstrike.data.progress import Display, Progress, no_display
from birdstrike.data.storage.out_folder import fills_out
from birdstrike.stages import Ledger, Stage, digest, inputs_of_diagnosis, run_stages

if TYPE_CHECKING:
    from birdstrike.doe.campaign.runner import RunCounts
    from birdstrike.doe.designs.design import Design
    from birdstrike.inversion.results.diagnosis import Diagnosis
    from birdstrike.solver.case.case import Case, CaseSource


SHOWN = (".json", ".csv", ".toml")
"""Endings of the files in the folders of a loop that its report shows."""
PLANNED = 0.8  # of a diagnosis' progress: its planned simulations; those at the fits follow


@dataclass(frozen=True)
class LoopPlan:
    """What the loop is asked to do.

    say: takes what the user should know, one line at a time; retry: failures stored before this time [s, Unix] are
    tried again, by all stages (doe.campaign.run.retry_before); channels: of the record, all where none is named;
    adopted: folder of a finished campaign that takes the place of the loop's own.
    """

    case: Case
    measured: Path
    out: Path
    design: Design
    seed: int
    workers: int | None
    trainer: str
    say: Callable[[str], None]
    diagnosed: bool = True
    retry: float = 0.0
    channels: tuple[str, ...] = ()
    baselines: tuple[Path, ...] = ()
    baseline_cases: tuple[Case, ...] = ()
    adopted: Path | None = None
    baseline_bird: str = "auto"
    heldout: Path | None = None

    @property
    def doe(self) -> Path:
        """The campaign's folder."""
        return self.adopted or self.out / "doe"

    @property
    def inversion(self) -> Path:
        """The inversion's folder."""
        return self.out / "inversion"

    @property
    def diagnosis(self) -> Path:
        """The diagnosis's folder."""
        return self.out / "diagnosis"

    @property
    def report(self) -> Path:
        """The page."""
        return self.out / "report.html"

    @property
    def ledger(self) -> Ledger:
        """Stages, findings and figures of the loop."""
        return Ledger(self.out / "close_the_loop.json")


@fills_out("close-the-loop")
def close_the_loop(
    case: CaseSource,
    measured: str | Path,
    out: str | Path,
    *,
    design: str | Path = "uniform",
    runs: int = 25,
    seed: int = 0,
    workers: int | None = None,
    trainer: str = "lm",
    diagnosis: bool = True,
    retry_failed: bool = False,
    channels: str | Sequence[str] = (),
    baseline: str | Path | Sequence[str | Path] = (),
    baseline_case: CaseSource | Sequence[CaseSource] = (),
    baseline_bird: str | None = None,
    doe: str | Path | None = None,
    heldout: str | Path | None = None,
    display: Display = no_display,
    say: Callable[[str], None] = warnings.warn,
) -> dict[str, Any]:
    """Run what is due of the whole loop: campaign, inversion, verification, diagnosis, report.

    The diagnosis simulates on meshes of its own and with more sensors, so that it seldom finds a run of a campaign to
    use. The campaign's workers are started afresh: a script that calls this needs `if __name__ == "__main__":`.

    Parameters
    ----------
    case : path, table or Case
        The shot's case.
    measured : path
        File of its record, or a shipped one's name.
    out : path
        Folder of the loop; the same call resumes, also after an error or Ctrl-C.
    design, runs : str or path, int
        Of the campaign, as run_doe takes them; not looked at with `doe`.
    seed : int
        Of design, network, emulators and diagnosis.
    workers : int, optional
        Simulations at a time; all cores by default.
    trainer : {'lm', 'adam', 'br', 'ensemble'}
        Of the network.
    diagnosis : bool
        Whether the residual is traced to an effect.
    retry_failed : bool
        Whether runs with a failure on record are tried again, and stages that hold some are done again.
    channels : str or sequence of str
        Of the record that are used; all where none is named.
    baseline, baseline_case : path and case, or sequences of them
        Records of the same rig in which nothing is suspected, by default those that the case names; a case for each in
        order, or none at all: they are of `case`.
    baseline_bird : {'auto', 'same', 'recipe', 'other'}, optional
        As `diagnose` takes it, by default the case's.
    doe : path, optional
        A finished campaign of run_doe, taken in place of the loop's own and left as it is.
    heldout : path, optional
        Another record of the case, which nothing in the diagnosis is fitted to.
    display : callable
        Context manager that shows a stage's heading and gives what takes its progress, 0..1.
    say : callable
        Takes what the user should know, one line at a time.

    Returns
    -------
    dict
        The content of `out/close_the_loop.json`, SI.

    Raises
    ------
    UserError
        For a case, record, design or argument that cannot be used.
    RunFailed
        Where the campaign, the verification or the diagnosis has too few runs that finish.
    """
    from birdstrike.data.curves import read_measured
    from birdstrike.doe.campaign.adoption import adopted_design
    from birdstrike.doe.campaign.run import retry_before
    from birdstrike.doe.campaign.worker import worker_count
    from birdstrike.doe.designs.registry import refuse_seed
    from birdstrike.inversion.diagnosis.diagnose import read_records
    from birdstrike.inversion.diagnosis.inference.hypotheses import birds_apart
    from birdstrike.inversion.observations.expected import Expected
    from birdstrike.inversion.observations.reader import read_record
    from birdstrike.solver.case.case import as_case
    from birdstrike.surrogate.inverse_network import refuse_unknown

    retry, used = retry_before(retry_failed), as_names("channels", channels)
    refuse_unknown(trainer)
    refuse_seed(seed)
    at_a_time = None if workers is None else worker_count(workers)
    with display("Check: case, record and design") as progress:
        loaded, record = as_case(case), resolve_measured(measured)
        bird = baseline_bird or loaded.diagnosis.baseline_bird
        birds_apart(bird)
        clean = baseline_files(loaded, as_list(baseline))
        clean_cases = tuple(map(as_case, as_list(baseline_case)))
        held_out = None if heldout is None else resolve_measured(heldout)
        if diagnosis:
            for warning in read_records(loaded, record, held_out, clean, clean_cases, used).warnings:
                say(warning)
        elif held_out is not None:
            raise UserError("a held-out record is for the diagnosis; leave out --heldout or --no-diagnosis")
        else:
            read_record(read_measured(record).only(used), Expected.of_case(loaded, loaded.time.end))
        adopted = None if doe is None else as_path("doe", doe)
        planned = (
            planned_runs(loaded, design, runs, seed, progress) if adopted is None else adopted_design(loaded, adopted)
        )
    plan = LoopPlan(
        case=loaded,
        measured=record,
        out=Path(out),
        design=planned,
        seed=seed,
        workers=at_a_time,
        trainer=trainer,
        say=say,
        diagnosed=diagnosis,
        retry=retry,
        channels=used,
        baselines=clean,
        baseline_cases=clean_cases,
        adopted=adopted,
        baseline_bird=bird,
        heldout=held_out,
    )
    plan.ledger.write(case=plan.case.name, measured=str(plan.measured), seed=plan.seed)
    run_stages(stages(plan), plan.ledger, display)
    return conclude(plan)


def baseline_files(case: Case, baseline: Sequence[str | Path]) -> tuple[Path, ...]:
    """Files of the baselines given, else of those that the case names; raises UserError for one that is not there."""
    return tuple(resolve_measured(one) for one in (baseline or case.diagnosis.baselines))


def planned_runs(case: Case, design: str | Path, runs: int, seed: int, progress: Progress) -> Design:
    """The design; raises UserError for one that cannot give separate estimates, before it is paid for."""
    from birdstrike.doe.designs.registry import make_design
    from birdstrike.doe.designs.space import ParameterSpace

    planned = make_design(design, ParameterSpace.of_case(case), runs, seed, progress)
    quality = planned.quality()
    if quality.deficient:
        raise UserError(quality.sentence)
    return planned


def stages(plan: LoopPlan) -> tuple[Stage, ...]:
    """The flow."""
    count = len(plan.design.numbers)
    origin = f", adopted from {plan.adopted}" if plan.adopted else ""
    return (
        Stage(
            "doe",
            f"Campaign: {count} runs, {plan.design.kind} design{origin}",
            partial(_campaign_inputs, plan),
            tuple(plan.doe / name for name in ("case.toml", "design.csv", "curves.csv", "summary.json")),
            partial(_campaign, plan),
            partial(_campaign_unfinished, plan),
        ),
        Stage(
            "inversion",
            "Inversion: network and emulator, each verified by the solver",
            partial(_inversion_inputs, plan),
            tuple(plan.inversion / name for name in ("inversion.json", "verification.csv")),
            partial(_inversion, plan),
            partial(_failures_retried, plan, plan.inversion),
        ),
        *((_diagnosis_stage(plan),) if plan.diagnosed else ()),
        Stage("report", "Report", partial(_report_inputs, plan), (plan.report,), partial(_report, plan)),
    )


def _diagnosis_stage(plan: LoopPlan) -> Stage:
    return Stage(
        "diagnosis",
        "Diagnosis: simulations of every effect, comparison of the models, before and after",
        partial(_diagnosis_inputs, plan),
        tuple(plan.diagnosis / name for name in ("diagnosis.json", "diagnosis.csv")),
        partial(_diagnosis, plan),
        partial(_failures_retried, plan, plan.diagnosis),
    )


def _campaign_unfinished(plan: LoopPlan) -> bool:
    """Whether the machine ended runs of the campaign, or runs have failed and the user asks for a retry."""
    from birdstrike.data.storage.files import read_json

    if plan.adopted:
        return False
    summary = read_json(plan.doe / "summary.json")
    ended = any(run["status"] == "pending" for run in summary.get("runs", []))
    return ended or (plan.retry > 0.0 and bool(summary.get("failed")))


def _failures_retried(plan: LoopPlan, folder: Path) -> bool:
    """Whether the user asks for a retry, and runs of the stage's folder have failed at every step factor."""
    from birdstrike.data.storage.store import RunStore
    from birdstrike.doe.campaign.run import failed_runs
    from birdstrike.doe.solvers import solver_for

    store, campaign = RunStore(folder / "runs"), RunStore(plan.doe / "runs")
    return plan.retry > 0.0 and bool(failed_runs(store, (campaign,), solver_for(plan.case).version))


def _campaign_inputs(plan: LoopPlan) -> Mapping[str, Any]:
    from birdstrike.doe.solvers import solver_for
    from birdstrike.solver.version import code_of

    return {
        "case": plan.case.model_dump(mode="json"),
        "sources": _sources(plan.case),
        "names": plan.design.names,
        "values": plan.design.values,
        "numbers": plan.design.numbers,
        "solver": solver_for(plan.case).version,
        "code": code_of("doe"),
    }


def _sources(case: Case) -> Mapping[str, str]:
    """Digests of the installed packages' sources that the case uses: they are in the keys of its runs."""
    return case.canonical().get("sources", {})


def _campaign(plan: LoopPlan, progress: Progress) -> None:
    from birdstrike.doe.campaign.campaign import run_campaign

    if plan.adopted:
        return  # finished, and found to fit before the first stage

    _hand_over(plan)
    run_campaign(
        plan.case,
        plan.design,
        plan.doe,
        workers=plan.workers,
        progress=lambda counts: progress(counts.done),
        say=plan.say,
        retry=plan.retry,
    )


def _hand_over(plan: LoopPlan) -> None:
    """Let a campaign of another case or design take over `doe/`, where the loop itself has made that folder.

    Only the claim on the folder goes; the results in `runs/` are named by what defines them and stay of use.
    """
    claims = [plan.doe / name for name in ("case.json", "design.csv")]
    if plan.ledger.read().get("campaign_is_own") or not any(claim.exists() for claim in claims):
        plan.ledger.write(campaign_is_own=True)
        for claim in claims:
            claim.unlink(missing_ok=True)


def _inversion_inputs(plan: LoopPlan) -> Mapping[str, Any]:
    from birdstrike.doe.solvers import solver_for
    from birdstrike.solver.version import code_of

    return {
        "solver": solver_for(plan.case).version,
        "sources": _sources(plan.case),
        "campaign": digest(plan.doe / "case.toml", plan.doe / "design.csv", plan.doe / "curves.csv"),
        "measured": digest(plan.measured),
        "name": plan.measured.name,
        "trainer": plan.trainer,
        "seed": plan.seed,
        "code": code_of("inversion"),
        **({"channels": plan.channels} if plan.channels else {}),
        **({"case": plan.case.model_dump(mode="json")} if plan.adopted else {}),
    }


def _inversion(plan: LoopPlan, progress: Progress) -> None:
    from birdstrike.inversion.extras import Extras
    from birdstrike.inversion.train_and_invert import train_and_invert

    _remove_other_diagnosis(plan)
    train_and_invert(
        plan.doe,
        plan.measured,
        plan.inversion,
        trainer=plan.trainer,
        case=plan.case if plan.adopted else None,
        seed=plan.seed,
        progress=progress,
        extras=Extras(
            refine=0,
            retry=plan.retry,
            channels=plan.channels,
            more_runs="run-doe --runs N" if plan.adopted else "--runs N",
        ),
    )


def _remove_other_diagnosis(plan: LoopPlan) -> None:
    """Remove the diagnosis of another record, case or options: `report`, `export` and `predict` would take it for one
    of the inversion that is about to be made. Its simulations stay."""
    from birdstrike.inversion.results.diagnosis_files import remove

    stage = _diagnosis_stage(plan)
    if plan.ledger.entry(stage.name).get("fingerprint") != stage.fingerprint():
        remove(plan.diagnosis)


def _diagnosis_inputs(plan: LoopPlan) -> Mapping[str, Any]:
    others = [] if plan.heldout is None else [plan.heldout]
    return inputs_of_diagnosis(
        [plan.case, *plan.baseline_cases],
        [plan.measured, *plan.baselines, *others, *(plan.doe / n for n in ("case.toml", "design.csv", "curves.csv"))],
        seed=plan.seed,
        channels=plan.channels,
        baseline_bird=plan.baseline_bird,
        baselines=len(plan.baselines),
        heldout=len(others),
    )


def _diagnosis(plan: LoopPlan, progress: Progress) -> None:
    from birdstrike.inversion.diagnosis.diagnose import DiagnosisOptions, diagnose

    @contextmanager
    def counted() -> Iterator[Callable[[RunCounts], None]]:
        yield onwards(progress)

    options = DiagnosisOptions(seed=plan.seed, workers=plan.workers, counter=counted, retry=plan.retry)
    diagnose(
        plan.case,
        plan.measured,
        plan.diagnosis,
        plan.doe,
        plan.heldout,
        options=options,
        baseline=plan.baselines,
        baseline_case=plan.baseline_cases,
        channels=plan.channels,
        baseline_bird=plan.baseline_bird,
    )


def onwards(progress: Progress) -> Callable[[RunCounts], None]:
    """Takes the counts of one batch of runs after another: the first ends at `PLANNED`, each further one takes half of
    what is left, for how many follow is not known beforehand."""
    begun, end, last = 0.0, PLANNED, 0.0

    def counted(counts: RunCounts) -> None:
        nonlocal begun, end, last
        if counts.done < last:
            begun, end = end, (1.0 + end) / 2.0
        last = counts.done
        progress(begun + last * (end - begun))

    return counted


def _report_inputs(plan: LoopPlan) -> Mapping[str, Any]:
    from birdstrike.solver.version import code_of

    folders = [plan.doe, plan.inversion, *([plan.diagnosis] if plan.diagnosed else []), plan.out / "comparison"]
    shown = [path for folder in folders for path in sorted(folder.glob("*")) if path.suffix in SHOWN]
    return {"made": [(path.name, digest(path)) for path in shown], "code": code_of("reports")}


def _report(plan: LoopPlan, progress: Progress) -> None:
    from birdstrike.reports.page.page import report

    report(plan.out, plan.report, doe=plan.adopted, progress=progress, diagnosed=plan.diagnosed)


def conclude(plan: LoopPlan) -> dict[str, Any]:
    """Findings, figures and paths, noted in the ledger and returned with the stages."""
    from birdstrike.inversion.results.diagnosis import Diagnosis
    from birdstrike.reports.results.findings import findings, key_figures
    from birdstrike.reports.results.parts import find_parts
    from birdstrike.reports.results.reading import read_results
    from birdstrike.solver.case.case import case_hash

    results = read_results(find_parts(plan.out, plan.adopted))
    diagnosed = Diagnosis.read(plan.diagnosis / "diagnosis.json") if plan.diagnosed else None
    return plan.ledger.write(
        diagnosis=answer_of(diagnosed) if diagnosed else None,
        stated=stated_truth(results.record.provenance),
        case_hash=case_hash(plan.case),
        simulated_record=results.record.simulated,
        findings=findings(results),
        figures=key_figures(results),
        warnings=results.warnings,
        paths={"report": plan.report, "doe": plan.doe, "inversion": plan.inversion},
        failed_strikes=dict(results.failures),
    )


def answer_of(found: Diagnosis) -> dict[str, Any]:
    """Verdict, sentence, the likeliest model with its magnitude in words, errors by sensor (SI).

    Errors of the first shot that has the effect.
    """
    from birdstrike.inversion.results.diagnosis import errors
    from birdstrike.inversion.results.diagnosis_text import in_its_sense, magnitude_words

    one, shot = found.effects[0], found.shown_shot
    before, after = errors(shot.before, shot.after)
    return {
        "verdict": found.verdict,
        "confidence_set": found.confidence_set,
        "sentence": found.sentence,
        "likeliest": {
            "name": one.name,
            "probability": one.probability,
            "magnitude": one.magnitude,
            "meaning": in_its_sense(one),
            "magnitude_words": magnitude_words(one),
        },
        "before": before.rmse,
        "before_less_baseline": before.rmse_less_baseline,
        "after": after and after.rmse,
        "after_less_baseline": after and after.rmse_less_baseline,
        "units": found.units,
    }


def stated_truth(provenance: Sequence[str]) -> list[str]:
    """Lines of a record's provenance that state what was true of the shot: those that begin with "Truth"."""
    return [line for line in provenance if line.startswith("Truth")]
