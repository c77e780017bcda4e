"""How far the numerical error of an external solver can be known: as far as its deck lets itself be refined."""

from __future__ import annotations

from collections.abc import Collection

from inversion.diagnosis.numerical import choices, variants
from solver.case import Case


def unrefined(case: Case, changed: Collection[str]) -> list[str]:
    """A warning where the deck has no place for some numerical choices; changed: the names of those that were."""
    if case.solver.name != "external":
        return []
    placed, wanted = variants(case, {}), [choice.name for choice in choices(case)]
    left = [name for name in wanted if name not in placed]
    if not left:
        return []
    known = f"from {', '.join(changed)} alone" if changed else "not at all"
    return [
        f"the deck has no place for {len(left)} of {len(wanted)} numerical choices ({', '.join(left)}): the other "
        f"solver's numerical error is known {known}, and what it does to the curves may be taken for an effect"
    ]
