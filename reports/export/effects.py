"""The effects that a diagnosis named, as cards: each where it lives in a deck, with what is known of it above."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from birdstrike.data.errors import CaseError, UserError
from birdstrike.data.unit_systems import UnitSystem
from birdstrike.inversion.labels import label_parts
from birdstrike.inversion.results.diagnosis import Diagnosis
from birdstrike.inversion.results.diagnosis_files import case_files
from birdstrike.inversion.results.same_shot import refuse_two_shots
from birdstrike.reports.export import lsdyna_materials, radioss_materials
from birdstrike.reports.export.cards import cards_of
from birdstrike.reports.export.fixed_columns import card, columns, comments
from birdstrike.solver.build import direction_of
from birdstrike.solver.case.bird import Bird
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.case.effects import shown
from birdstrike.solver.effects.registry import effect_named, effects

FIRST_NUMBER = 1001
"""Numbers of the cards of effects begin here, apart from the birds'."""
LEAST = 0.05
"""Probability from which on an effect has a card, besides those of the credible set."""
METAL = ("plate_modulus", "plate_density", "plate_yield", "plate_hardening", "plate_rate_hardening")
SPRINGS = {"clamp_rotation": ("rotational", "N/rad", "about the edge"), "edge_slip": ("in_plane", "Pa", "in the plane")}
WIDE = 20


@dataclass(frozen=True)
class FoundEffect:
    """One effect of a diagnosis; magnitude, interval_95 in SI; whole: its name in diagnosis.json, with place or shot.

    changed: the case of the shot that alone has it, else of the first shot, with it and what the diagnosis fitted; None
    where that cannot carry it.
    """

    name: str
    whole: str
    magnitude: float
    interval_95: tuple[float, float] | None
    probability: float
    changed: Case | None


@dataclass(frozen=True)
class FoundEffects:
    """verdict: of the diagnosis, in its own words."""

    verdict: str
    sentence: str
    effects: tuple[FoundEffect, ...]


def read_effects(folder: Path, case: str | Path | None = None) -> FoundEffects | None:
    """The effects of the diagnosis in a folder, or in its `diagnosis`; None where there is none. Raises UserError."""
    path = next((p for p in (folder / "diagnosis.json", folder / "diagnosis" / "diagnosis.json") if p.is_file()), None)
    if path is None:
        return None
    refuse_two_shots(folder)
    diagnosis = Diagnosis.read(path)
    named = {name for member in diagnosis.confidence_set for name in member.split("+")}
    declared, shots = load_case(_declared(path, case)), [one.name for one in diagnosis.shots]
    known, found = effects(), list[FoundEffect]()
    for one in diagnosis.effects:
        name, _, shot = label_parts(one.name)
        if name not in known or not one.magnitude or (one.name not in named and one.probability < LEAST):
            continue
        own = declared if case or not shot else load_case(_case_of_shot(path.parent, shots, shot))
        changed = _changed(own, _point(diagnosis, shot), _acting(one.name), one.magnitude)
        found.append(FoundEffect(name, one.name, one.magnitude, one.interval_95, one.probability, changed))
    return FoundEffects(diagnosis.verdict, diagnosis.sentence, tuple(found))


def _point(diagnosis: Diagnosis, shot: str) -> dict[str, float]:
    """What the diagnosis fitted in a shot, of the first where none is named, SI by dotted key."""
    states = next((one for one in diagnosis.shots if one.name == shot), diagnosis)
    return (states.after or states.before).point


def _acting(label: str) -> str:
    """An effect's name in a case: with its set of nodes; a fault of one sensor, which has no card, as that of all."""
    name, place, _ = label_parts(label)
    return f"{name}.{place}" if place and effects()[name].alone is not None else name


def _declared(path: Path, given: str | Path | None) -> str | Path:
    beside = [path.parent / "case.toml", path.parent.parent / "doe" / "case.toml", path.parent.parent / "case.toml"]
    found = given or next((file for file in beside if file.is_file()), None)
    if found is None:
        raise UserError(f"{path.parent} does not hold the declared case; name it: --case CASE.toml")
    return found


def _case_of_shot(folder: Path, shots: Sequence[str], shot: str) -> Path:
    """File of the case of which a shot is, that has an effect for itself; raises UserError where there is none."""
    file = folder / dict(zip(shots, case_files(shots), strict=True)).get(shot, f"diagnosis_{shot}.toml")
    if not file.is_file():
        raise UserError(
            f"{folder} does not hold {file.name}, the declared case of shot {shot} (an earlier version made this "
            "diagnosis, or files were moved); repeat the diagnose command with the same --out, whose simulations are "
            "stored, or name the case: --case CASE.toml"
        )
    return file


def _changed(declared: Case, point: Mapping[str, float], name: str, magnitude: float) -> Case | None:
    try:
        return declared.with_values(point).with_effects({name: magnitude}).resolved()
    except CaseError:
        return None


def effect_lines(found: FoundEffects, system: UnitSystem, code: str) -> list[str]:
    """The cards of all effects, with what is known of each above it; code: "lsdyna" or "radioss"."""
    sign, writer = ("$", _Lsdyna(system)) if code == "lsdyna" else ("#", _Radioss(system))
    head = [
        f"Effects of the diagnosis. Verdict: {found.verdict.replace('_', ' ')}. {found.sentence}".strip(),
        f"Each is alone in its cards, numbered from {FIRST_NUMBER}: use those that you adopt in place of your own.",
    ]
    if not found.effects:
        return comments(sign, [head[0], "No effect is in the credible set: there is nothing to add to the deck."])
    lines = comments(sign, head)
    for number, effect in enumerate(found.effects, start=FIRST_NUMBER):
        lines += comments(sign, _about(effect))
        lines += writer.lines(effect, number)
    return lines


def _about(effect: FoundEffect) -> Iterator[str]:
    known = effect_named(_acting(effect.whole))
    magnitude = shown(effect.magnitude, known.unit, 4)
    limits = effect.interval_95
    interval = "no interval"
    if limits is not None:
        interval = f"95 % interval {shown(limits[0], known.unit, 4)} .. {shown(limits[1], known.unit, 4)}"
    yield f"Effect {effect.whole}: {known.meaning}"
    yield f"magnitude {magnitude}, {interval}, probability {effect.probability:.3g}"
    if effect.name == "bird_mass":
        yield "all other constants of the bird are those that the diagnosis fitted; what it did not seek is declared"
    if effect.changed is not None:
        yield from _beside(effect, effect.changed.bird)


def _beside(effect: FoundEffect, bird: Bird) -> Iterator[str]:
    """What of a bird changes with an effect and stands in no card of its: the bird with the effect is given."""
    if effect.name == "bird_mass" and bird.method == "sph":
        share = bird.actual_mass / (bird.actual_mass - effect.magnitude)
        yield f"particles carry a mass of their own (*ELEMENT_SPH, /PROP/SPH): multiply it by {share:.6g} too"
    if effect.name == "impact_angle" and bird.shape != "sphere":
        yield "the bird's axis turns with its velocity: turn its nodes by the magnitude too"


class _Writer:
    """Cards of one code: a method for each place in a deck, common ones here."""

    sign = "$"

    def __init__(self, system: UnitSystem) -> None:
        self.system = system

    def lines(self, effect: FoundEffect, number: int) -> list[str]:
        """The cards of an effect, or a comment that says why there is none."""
        if effect.changed is None:
            return comments(self.sign, ["The declared case cannot carry this magnitude: there is no card."])
        place = self.place(effect.name)
        if place is None:
            return comments(self.sign, [_without_card(effect, self.system)])
        try:
            return list(place(effect, effect.changed, number))
        except UserError as error:
            return comments(self.sign, [f"It has no card here: {error}."])

    def place(self, name: str) -> Callable[[FoundEffect, Case, int], Iterator[str]] | None:
        """What writes an effect's cards; None for one that has none."""
        if name in METAL:
            return self.metal
        if name in SPRINGS:
            return self.springs
        places = {
            "plate_thickness": self.thickness,
            "plate_damping": self.damping,
            "impact_speed": self.velocity,
            "impact_angle": self.velocity,
            "bird_friction": self.friction,
            "bird_mass": self.bird,
        }
        return places.get(name)

    def spring(self, effect: FoundEffect, case: Case) -> tuple[float, str]:
        """Stiffness of the frame per length of edge in the system's unit, and what it is."""
        key, unit, where = SPRINGS[effect.name]
        held = [case.plate.edges] if case.target is None else list(case.target.supports.values())
        if case.target is not None and (alone := label_parts(effect.whole)[1]):
            held = [case.target.supports[alone]]
        springs = {getattr(one, key) for one in held if not isinstance(one, str)} - {None, 0.0}
        stiffest, softest = (self.system.value(of(springs), unit) for of in (max, min))
        about = f"stiffness {where} per length of edge; a node has it times the length of edge that belongs to it"
        if softest < stiffest:
            about += f"; that is the stiffest of your supports, whose others go down to {softest:.9g}"
        return stiffest, about

    def thickness(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:
        raise NotImplementedError

    metal = springs = damping = velocity = friction = bird = thickness


def _struck(case: Case) -> tuple[float, Any]:
    """Thickness [m] and metal of what is struck."""
    if case.target is None:
        return case.plate.thickness, case.plate.material
    part = case.target.struck_part
    return part.thickness, case.target.materials[part.material]


def _velocity(case: Case, system: UnitSystem) -> list[float]:
    return [float(c) for c in system.value(case.impact.speed, "m/s") * direction_of(case.impact)]


def _damping(case: Case, system: UnitSystem) -> float:
    rate = case.plate.damping if case.target is None else case.target.damping
    return system.value(2.0 * rate, "1/s")


MATERIAL = {"bird_porosity": "the bird's equation of state", "rivet_strength": "the strengths of the rivets"}
"""Effects on constants that no common card holds."""


def _without_card(effect: FoundEffect, system: UnitSystem) -> str:
    known = effects()[effect.name]
    if known.fault is not None:
        return (
            "It is of the instrument: nothing changes in the deck; correct the record, or the curve that you compare."
        )
    if effect.name in MATERIAL:
        return f"It has no card of its own: it changes {MATERIAL[effect.name]}; read its constants from the case."
    lengths: Mapping[str, str] = {"m": f"; {system.value(effect.magnitude, 'm'):.7g} {system.base['length']}"}
    return (
        f"It has no card of its own: change the geometry or the initial state of the deck{lengths.get(known.unit, '')}."
    )


class _Lsdyna(_Writer):
    def thickness(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:  # noqa: ARG002
        thickness, _ = _struck(case)
        yield from ("*SECTION_SHELL", "$#   secid    elform      shrf       nip", card(number, 2, 5.0 / 6.0, 5))
        yield card(*[self.system.value(thickness, "m")] * 4)

    def metal(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:
        yield from lsdyna_materials.metal_lines(effect.name, _struck(case)[1], number, self.system)

    def springs(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:
        stiffness, about = self.spring(effect, case)
        yield from comments("$", [about])
        yield from ("*MAT_SPRING_ELASTIC", "$#     mid         k", card(number, stiffness))

    def damping(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:  # noqa: ARG002
        alpha = _damping(case, self.system)
        yield from comments("$", [f"Damping constant over time, LCID {number} of *DAMPING_PART_MASS of your plate."])
        yield from ("*DEFINE_CURVE", card(number, 0, 1.0, 1.0, 0.0, 0.0, 0))
        yield from (columns((0.0, WIDE), (alpha, WIDE)), columns((1e20, WIDE), (alpha, WIDE)))

    def velocity(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:  # noqa: ARG002
        names = ("vx", "vy", "vz")
        yield from comments("$", [f"Velocity of the bird: &vx{number}, &vy{number}, &vz{number} in *INITIAL_VELOCITY."])
        for name, value in zip(names, _velocity(case, self.system), strict=True):
            yield from self.parameter(f"{name}{number}", value)

    def friction(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:  # noqa: ARG002
        yield from comments("$", [f"Coulomb friction: &fric{number} as FS and FD of the bird's *CONTACT."])
        yield from self.parameter(f"fric{number}", case.impact.friction)

    def bird(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:  # noqa: ARG002
        for one in cards_of(case.bird.material, case.bird.actual_density):
            yield from lsdyna_materials.keyword_lines(one, number, self.system)

    @staticmethod
    def parameter(name: str, value: float) -> Iterator[str]:
        """A number by name."""
        yield from ("*PARAMETER", f"R {name:<8}{card(value)}")


class _Radioss(_Writer):
    sign = "#"

    def thickness(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:
        thickness, material = _struck(case)
        yield from radioss_materials.shell_lines(effect.name, material, thickness, number, self.system)

    def metal(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:
        yield from radioss_materials.metal_lines(effect.name, _struck(case)[1], number, self.system)

    def springs(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:  # noqa: ARG002
        stiffness, about = self.spring(effect, case)
        freedom = "K4, K5 and K6" if effect.name == "clamp_rotation" else "the two K along the plate"
        yield from comments("#", [f"{freedom} of /PROP/SPR_GENE of your supports: {stiffness:.9g}, {about}"])

    def damping(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:
        yield from self.to_complete(
            [
                f"/DAMP/{number}",
                effect.name,
                "#              Alpha                Beta  grnod_id   skew_id              Tstart               Tstop",
                columns((_damping(case, self.system), WIDE), (0.0, WIDE), ("PLATE", 10), (0, 10)),
            ],
            "PLATE is the number of your plate's group of nodes",
        )

    def velocity(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:
        yield from self.to_complete(
            [
                f"/INIVEL/TRA/{number}",
                effect.name,
                "#                 Vx                  Vy                  Vz   Gnod_id   Skew_id",
                columns(*((v, WIDE) for v in _velocity(case, self.system)), ("BIRD", 10), (0, 10)),
            ],
            "BIRD is the number of your bird's group of nodes",
        )

    def friction(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:  # noqa: ARG002
        yield from self.to_complete(
            [
                "#              Stfac                Fric              GAPmin              Tstart               Tstop",
                columns((None, WIDE), (case.impact.friction, WIDE)),
            ],
            "Fric of the bird's /INTER/TYPE7",
        )

    def bird(self, effect: FoundEffect, case: Case, number: int) -> Iterator[str]:  # noqa: ARG002
        bird = case.bird
        sph = bird.method == "sph"
        yield from radioss_materials.bird_lines(bird.material, bird.actual_density, number, self.system, sph)

    @staticmethod
    def to_complete(lines: list[str], what: str) -> Iterator[str]:
        """Cards that need a number of the user's own deck, as comments to be completed."""
        yield from comments("#", [f"To complete and uncomment; {what}:"])
        yield from (f"#{line}" if not line.startswith("#") else line for line in lines)
