"""birdstrike: constitutive parameters of a bird from one instrumented strike, with honest intervals.

The verbs of the command line are functions here, imported when first used.
"""

from __future__ import annotations

from importlib import import_module
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
    from birdstrike.inversion.audit.audit import audit
    from birdstrike.inversion.diagnosis.diagnose import diagnose
    from birdstrike.inversion.train_and_invert import train_and_invert
    from birdstrike.loop import close_the_loop
    from birdstrike.reports.page.page import report
    from birdstrike.reports.verification.verify import verify
    from birdstrike.solver.case.case import load_case

_PACKAGES = ("data", "solver", "doe", "surrogate", "inversion", "reports")

_PUBLIC = {
    "load_case": ("birdstrike.solver.case.case", "load_case"),
    "check": ("birdstrike.cli.check", "check"),
    "simulate": ("birdstrike.cli.simulate", "simulate"),
    "compare_methods": ("birdstrike.cli.compare_methods", "compare_methods"),
    "converge": ("birdstrike.cli.converge", "converge"),
    "new": ("birdstrike.cli.new", "new"),
    "import_curve": ("birdstrike.cli.import_curve", "import_curve"),
    "export": ("birdstrike.cli.export", "export"),
    "run_doe": ("birdstrike.cli.run_doe", "run_doe"),
    "train_and_invert": ("birdstrike.inversion.train_and_invert", "train_and_invert"),
    "diagnose": ("birdstrike.inversion.diagnosis.diagnose", "diagnose"),
    "audit": ("birdstrike.inversion.audit.audit", "audit"),
    "report": ("birdstrike.reports.page.page", "report"),
    "close_the_loop": ("birdstrike.loop", "close_the_loop"),
    "verify": ("birdstrike.reports.verification.verify", "verify"),
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


def _refuse_missing_links(folder: Path = Path(__file__).parent) -> None:
    """Raise ImportError where the links to the packages were checked out as text files, as on Windows without them."""
    missing = [name for name in _PACKAGES if not (folder / name).is_dir()]
    if missing:
        raise ImportError(
            f"birdstrike/{missing[0]} in {folder} is no folder: the repository's symbolic links were not checked out; "
            "install the wheel (pip install birdstrike), or clone again with `git clone -c core.symlinks=true` where "
            "your system allows symbolic links"
        )


_refuse_missing_links()


def __getattr__(name: str) -> Any:
    """Public verbs, imported late: asking for help must not load torch."""
    if name not in _PUBLIC:
        raise AttributeError(f"birdstrike has no {name}; it has {', '.join(__all__)}")
    module, attribute = _PUBLIC[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted(__all__)
