"""birdstrike: constitutive parameters of a bird from one instrumented impact, with honest intervals.

The commands are functions here (`simulate`, `run_doe`, ...), and what they take and return are classes here (`Case`,
`Histories`, ...); each is imported when first used. The six packages are links to the folders at the root of the
repository and are read in the order data, solver, doe, surrogate, inversion, reports.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from birdstrike.cli.check import check
    from birdstrike.cli.compare import compare
    from birdstrike.cli.compare_methods import compare_methods
    from birdstrike.cli.converge import converge
    from birdstrike.cli.evidence import evidence
    from birdstrike.cli.export import export
    from birdstrike.cli.import_curve import import_curve
    from birdstrike.cli.new import new
    from birdstrike.cli.run_doe import run_doe
    from birdstrike.cli.simulate import simulate
    from birdstrike.cli.start import start
    from birdstrike.data.curves import Measured
    from birdstrike.data.dataset import Dataset
    from birdstrike.data.errors import RunFailed, UserError
    from birdstrike.data.histories import Histories, Snapshot
    from birdstrike.doe.campaign.runner import RunCounts
    from birdstrike.doe.designs.registry import Design
    from birdstrike.doe.designs.space import ParameterSpace
    from birdstrike.inversion.audit.audit import audit
    from birdstrike.inversion.diagnosis.diagnose import diagnose
    from birdstrike.inversion.diagnosis.pipeline import DiagnosisOptions
    from birdstrike.inversion.extras import Extras
    from birdstrike.inversion.mesh_convergence.convergence import MeshConvergence
    from birdstrike.inversion.mesh_convergence.grid_convergence import CurveConvergence, GridConvergence
    from birdstrike.inversion.mesh_convergence.meshes import Mesh
    from birdstrike.inversion.method_comparison import MethodScore
    from birdstrike.inversion.models.calibrate_models import calibrate_models
    from birdstrike.inversion.models.results import ModelAnswer, ModelComparison
    from birdstrike.inversion.prediction.answer import Prediction
    from birdstrike.inversion.prediction.predict import PredictOptions, predict
    from birdstrike.inversion.results.diagnosis import Diagnosis, EffectFigures
    from birdstrike.inversion.results.estimates import Answer, Estimate
    from birdstrike.inversion.results.inversion import Inversion
    from birdstrike.inversion.train_and_invert import train_and_invert
    from birdstrike.loop import close_the_loop
    from birdstrike.reports.evidence.archive import Evidence
    from birdstrike.reports.explore.explore import explore
    from birdstrike.reports.page.page import report
    from birdstrike.reports.verification.verify import Verification, verify
    from birdstrike.solver.case.case import Case, load_case
    from birdstrike.solver.effects.registry import Effect

_PACKAGES = ("data", "solver", "doe", "surrogate", "inversion", "reports")

# Public name -> module, and the name there where it differs.
_VERBS = {
    "load_case": "birdstrike.solver.case.case",
    "check": "birdstrike.cli.check",
    "simulate": "birdstrike.cli.simulate",
    "start": "birdstrike.cli.start",
    "compare_methods": "birdstrike.cli.compare_methods",
    "calibrate_models": "birdstrike.inversion.models.calibrate_models",
    "converge": "birdstrike.cli.converge",
    "new": "birdstrike.cli.new",
    "import_curve": "birdstrike.cli.import_curve",
    "export": "birdstrike.cli.export",
    "compare": "birdstrike.cli.compare",
    "evidence": "birdstrike.cli.evidence",
    "run_doe": "birdstrike.cli.run_doe",
    "train_and_invert": "birdstrike.inversion.train_and_invert",
    "diagnose": "birdstrike.inversion.diagnosis.diagnose",
    "predict": "birdstrike.inversion.prediction.predict",
    "audit": "birdstrike.inversion.audit.audit",
    "report": "birdstrike.reports.page.page",
    "explore": "birdstrike.reports.explore.explore",
    "close_the_loop": "birdstrike.loop",
    "verify": "birdstrike.reports.verification.verify",
}
_TYPES = {
    "Case": "birdstrike.solver.case.case",
    "Effect": "birdstrike.solver.effects.registry",
    "Histories": "birdstrike.data.histories",
    "Snapshot": "birdstrike.data.histories",
    "Measured": "birdstrike.data.curves",
    "ParameterSpace": "birdstrike.doe.designs.space",
    "Design": "birdstrike.doe.designs.registry",
    "Dataset": "birdstrike.data.dataset",
    "RunCounts": "birdstrike.doe.campaign.runner",
    "Inversion": "birdstrike.inversion.results.inversion",
    "Answer": "birdstrike.inversion.results.estimates",
    "Estimate": "birdstrike.inversion.results.estimates",
    "Extras": "birdstrike.inversion.extras",
    "MethodScore": "birdstrike.inversion.method_comparison",
    "ModelAnswer": "birdstrike.inversion.models.results",
    "ModelComparison": "birdstrike.inversion.models.results",
    "Mesh": "birdstrike.inversion.mesh_convergence.meshes",
    "MeshConvergence": "birdstrike.inversion.mesh_convergence.convergence",
    "GridConvergence": "birdstrike.inversion.mesh_convergence.grid_convergence",
    "CurveConvergence": "birdstrike.inversion.mesh_convergence.grid_convergence",
    "Diagnosis": "birdstrike.inversion.results.diagnosis",
    "EffectFigures": "birdstrike.inversion.results.diagnosis",
    "DiagnosisOptions": "birdstrike.inversion.diagnosis.pipeline",
    "PredictOptions": "birdstrike.inversion.prediction.predict",
    "Prediction": "birdstrike.inversion.prediction.answer",
    "Evidence": "birdstrike.reports.evidence.archive",
    "Verification": "birdstrike.reports.verification.verify",
    "UserError": "birdstrike.data.errors",
    "RunFailed": "birdstrike.data.errors",
}
_PUBLIC = _VERBS | _TYPES

__all__ = [
    "Answer",
    "Case",
    "CurveConvergence",
    "Dataset",
    "Design",
    "Diagnosis",
    "DiagnosisOptions",
    "Effect",
    "EffectFigures",
    "Estimate",
    "Evidence",
    "Extras",
    "GridConvergence",
    "Histories",
    "Inversion",
    "Measured",
    "Mesh",
    "MeshConvergence",
    "MethodScore",
    "ModelAnswer",
    "ModelComparison",
    "ParameterSpace",
    "PredictOptions",
    "Prediction",
    "RunCounts",
    "RunFailed",
    "Snapshot",
    "UserError",
    "Verification",
    "audit",
    "calibrate_models",
    "check",
    "close_the_loop",
    "compare",
    "compare_methods",
    "converge",
    "diagnose",
    "evidence",
    "explore",
    "export",
    "import_curve",
    "load_case",
    "new",
    "predict",
    "report",
    "run_doe",
    "simulate",
    "start",
    "train_and_invert",
    "verify",
]


def _refuse_missing_links(folder: Path = Path(__file__).parent) -> None:
    """Raise ImportError where the links to the packages were checked out as text files, as on Windows without them."""
    missing = [name for name in _PACKAGES if not (folder / name).is_dir()]
    if missing:
        raise ImportError(
            f"birdstrike/{missing[0]} in {folder} is no folder: the repository's symbolic links were not checked out; "
            "install a wheel of birdstrike that was built elsewhere, or clone again with "
            "`git clone -c core.symlinks=true` where your system allows symbolic links"
        )


_refuse_missing_links()


def __getattr__(name: str) -> Any:
    """Public verbs and classes, imported late: asking for help must not load torch."""
    if name not in _PUBLIC:
        raise AttributeError(f"birdstrike has no {name}; it has {', '.join(__all__)}")
    module, _, attribute = _PUBLIC[name].partition(":")
    return getattr(import_module(module), attribute or name)


def __dir__() -> list[str]:
    return sorted(__all__)
