"""What a mesh-convergence study leaves behind: its JSON, its curves with their band, and its warnings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from birdstrike.data.formatting import listing
from birdstrike.data.histories import Array, Histories
from birdstrike.doe.campaign.run import Finished
from birdstrike.inversion.mesh_convergence.convergence import MeshConvergence
from birdstrike.inversion.mesh_convergence.grid_convergence import (
    FORMAL,
    SAFETY_AFAR,
    CurveConvergence,
    GridConvergence,
)
from birdstrike.inversion.mesh_convergence.meshes import Mesh, not_refined, unevenly_refined
from birdstrike.inversion.mesh_convergence.scalars import Scalar
from birdstrike.inversion.misfit import rms


def curves_of(found: MeshConvergence) -> Histories:
    """Every mesh's curve, 1 the finest, and the band of the user's, as one table on the common clock."""
    own = found.histories[found.user]
    channels: dict[str, Array] = {}
    units: dict[str, str] = {}
    for name, unit in own.units.items():
        for number, histories in enumerate(found.histories, start=1):
            channels[f"{name}_mesh{number}"] = histories.channels[name]
        channels[f"{name}_uncertainty"] = found.curves[name].bands[found.own]
        units |= {key: unit for key in channels if key not in units}
    return Histories(own.time, channels, units)


def as_json(found: MeshConvergence) -> dict[str, Any]:
    """The content of `convergence.json`, SI; meshes finest first, `user_mesh` and `meshes_used` counted from 0."""
    return {
        "user_mesh": found.user,
        "meshes_used": list(found.used),
        "meshes": [_mesh_json(mesh, run) for mesh, run in zip(found.meshes, found.runs, strict=True)],
        "scalars": {name: _scalar_json(found, *entry) for name, entry in found.scalars.items()},
        "curves": {name: _curve_json(found, name, curve) for name, curve in found.curves.items()},
        "warnings": warnings_of(found),
    }


def _mesh_json(mesh: Mesh, run: Finished) -> dict[str, Any]:
    summary = run.histories.summary
    known = ("steps", "wall_s", "energy_error", "momentum_error", "eroded_particles", "eroded_shells")
    return mesh.as_json() | {"run": run.key, "step_factor": run.step_factor} | {k: summary.get(k) for k in known}


def _scalar_json(
    found: MeshConvergence, scalar: Scalar, entry: GridConvergence, values: Sequence[float]
) -> dict[str, Any]:
    return {
        "unit": scalar.unit,
        "values": list(values),
        "behaviour": entry.behaviour,
        "order": entry.order,
        "order_used": entry.order_used,
        "safety_factor": entry.safety,
        "extrapolated": entry.extrapolated,
        "uncertainty_finest": entry.uncertainties[0],
        "gci_finest": entry.index(0),
        "uncertainty_user": entry.uncertainties[found.own],
        "gci_user": entry.index(found.own),
    }


def _curve_json(found: MeshConvergence, name: str, curve: CurveConvergence) -> dict[str, Any]:
    own = found.histories[found.user]
    band = curve.bands[found.own]
    return {
        "unit": own.units[name],
        "order_used": curve.order,
        "safety_factor": curve.safety,
        "shares": curve.shares,
        "largest_uncertainty_user": float(band.max()),
        "rms_uncertainty_user": rms(band),
        "largest_value_user": float(np.abs(own.channels[name]).max()),
    }


def warnings_of(found: MeshConvergence) -> list[str]:
    """What makes the study say less than it seems to, the gravest first."""
    lines = [
        f"{what} on some meshes only: they are different events, and no order of convergence holds"
        for key, what in (("eroded_particles", "the bird erodes"), ("eroded_shells", "the plate tears"))
        if {run.histories.summary.get(key, 0) > 0 for run in found.runs} == {True, False}
    ]
    entries = {name: entry for name, (_, entry, _) in found.scalars.items()}
    lines += [
        f"{name}: the observed order {entry.order:.3g} is far above the scheme's {FORMAL:g}, as where two meshes agree "
        "by chance: its uncertainty is the spread of the meshes, which is more than the index; add a mesh "
        "(--meshes) or choose another --ratio"
        for name, entry in entries.items()
        if entry.spread_taken
    ]
    unordered = {name: entry for name, entry in entries.items() if entry.behaviour in ("oscillating", "diverging")}
    lines += [
        f"{name} is {entry.behaviour}: no order, its uncertainty is the spread of the meshes"
        for name, entry in unordered.items()
    ]
    lines += [
        f"the shells of {part} are refined by {listing([f'{ratio:.3g}' for ratio in ratios])}, not as the bird's "
        "particles are: the generator makes whole numbers of shells between its lines, and neither order nor index is "
        "of one ratio; choose a target.generator.element_size that divides its lengths, or another --ratio"
        for part, ratios in unevenly_refined([found.meshes[i] for i in found.used]).items()
    ]
    if kept := not_refined(found.meshes[0].case):
        lines.append(
            f"the deck has no place for {kept[0]}, which all meshes have alike: its share of the error is in neither "
            "order nor index; give it a place, or vary it by hand"
        )
    halved = [mesh.particles for mesh, run in zip(found.meshes, found.runs, strict=True) if run.step_factor != 1.0]
    if halved:
        lines.append(f"the mesh of {halved[0]} particles needed half the time step: not spacing alone differs")
    lines += _cut_off(found)
    for name, entry in entries.items():
        if entry.order is not None and entry.safety == SAFETY_AFAR and not entry.spread_taken:
            lines.append(
                f"{name}: observed order {entry.order:.2f} is not within 10 % of the scheme's {FORMAL:g}: taken as "
                f"{entry.order_used:.3g}, with a factor of safety of {entry.safety:g}"
            )
    return lines


def _cut_off(found: MeshConvergence) -> Iterator[str]:
    """A warning for the peaks that the record cuts off, by the meshes used on which it does."""
    cut: dict[tuple[int, ...], list[str]] = {}
    for scalar, _, _ in found.scalars.values():
        on = tuple(found.meshes[i].particles for i in found.used if scalar.at_the_end(found.histories[i]))
        if on:
            cut.setdefault(on, []).append(scalar.name)
    for on, names in cut.items():
        where = "all meshes" if len(on) == len(found.used) else f"the mesh of {' and of '.join(map(str, on))} particles"
        verb = "lies" if len(names) == 1 else "lie"
        yield f"{listing(names)} {verb} at time.end on {where}: lengthen time.end to see the peak itself"
