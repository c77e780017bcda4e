"""birdstrike: constitutive parameters of a bird from one instrumented strike, with honest intervals.

The verbs of the command line are functions here, imported when first used.
"""

from __future__ import annotations

from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from birdstrike.cli.check import check
    from birdstrike.cli.compare_methods import compare_methods
    from birdstrike.cli.converge import converge
    from birdstrike.cli.export import export
    from birdstrike.cli.import_curve import import_curve
    from birdstrike.cli.new import new
    from birdstrike.cli.run_doe import run_doe
    from birdstrike.cli.simulate import simulate
    from birdstrike.loop import close_the_loop
    from inversion.audit.audit import audit
    from inversion.diagnosis.diagnose import diagnose
    from inversion.train_and_invert import train_and_invert
    from reports.page import report
    from reports.verification.verify import verify
    from solver.case import load_case

ROOT = Path(__file__).resolve().parent.parent
COMPANIONS = ("data", "solver", "doe", "surrogate", "inversion", "reports")

_PUBLIC = {
    "load_case": ("solver.case", "load_case"),
    "check": ("birdstrike.cli.check", "check"),
    "simulate": ("birdstrike.cli.simulate", "simulate"),
    "compare_methods": ("birdstrike.cli.compare_methods", "compare_methods"),
    "converge": ("birdstrike.cli.converge", "converge"),
    "new": ("birdstrike.cli.new", "new"),
    "import_curve": ("birdstrike.cli.import_curve", "import_curve"),
    "export": ("birdstrike.cli.export", "export"),
    "run_doe": ("birdstrike.cli.run_doe", "run_doe"),
    "train_and_invert": ("inversion.train_and_invert", "train_and_invert"),
    "diagnose": ("inversion.diagnosis.diagnose", "diagnose"),
    "audit": ("inversion.audit.audit", "audit"),
    "report": ("reports.page", "report"),
    "close_the_loop": ("birdstrike.loop", "close_the_loop"),
    "verify": ("reports.verification.verify", "verify"),
}

__all__ = [
    "audit",
    "check",
    "close_the_loop",
    "compare_methods",
    "converge",
    "diagnose",
    "export",
    "import_curve",
    "load_case",
    "new",
    "report",
    "run_doe",
    "simulate",
    "train_and_invert",
    "verify",
]


def _refuse_foreign_companions(root: Path = ROOT) -> None:
    """Raise ImportError where another package called `solver`, `data`, ... hides one of birdstrike's own."""
    for name in COMPANIONS:
        spec = find_spec(name)
        found_in = [] if spec is None else spec.submodule_search_locations or [spec.origin or ""]
        places = [Path(place).resolve() for place in found_in]
        if root / name not in places:
            found = f"{places[0]} hides it" if places else "it is missing"
            raise ImportError(
                f"birdstrike needs its own package `{name}` in {root}, but {found}; "
                f"start Python elsewhere, rename that one, or install birdstrike in an environment of its own"
            )


_refuse_foreign_companions()


def __getattr__(name: str) -> Any:
    """Public verbs, imported late: asking for help must not load torch."""
    if name not in _PUBLIC:
        raise AttributeError(f"birdstrike has no {name}; it has {', '.join(__all__)}")
    module, attribute = _PUBLIC[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted(__all__)
