"""Which changes of a case an external solver's deck can carry: those that change what its template fills in."""

from __future__ import annotations

from pathlib import Path

import pytest

from birdstrike.data.errors import CaseError
from birdstrike.doe.external.deck import has_place, missing_in_deck, refuse_missing_in_deck, unsupported_by_deck
from birdstrike.doe.external.external import external_solver
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.effects.registry import effects
from tests.doe.external_case import DECK, oscillator, written

SPRINGS = '{% if plate.edges is mapping %}{{ plate.edges.rotational | to("kN*m/rad/m") }}{% else %}rigid{% endif %}\n'


def carried(case: Case) -> set[str]:
    """Effects that the case's deck can carry."""
    return {name for name in effects() if not unsupported_by_deck(case, name)}


OF_RECORD = {"time_offset", "sensor_gain", "sensor_bandwidth", "sensor_drift"}
OF_DECK = OF_RECORD | {"plate_thickness", "impact_speed", "impact_angle"}
"""The oscillator's deck names the thickness (in a comment) and the velocity's normal component."""


@pytest.mark.parametrize(
    ("line", "more"),
    [
        ("", set()),
        ('{{ bird.mass | to("kg") }}', {"bird_mass"}),
        ('{{ bird.density | to("t/mm^3") }}', {"bird_mass"}),
        ('{{ bird.length | to("mm") }}', {"bird_length"}),
        ('{{ impact.offset[0] | to("mm") }}', {"impact_offset"}),
        ('{{ impact.offset[1] | to("mm") }}', {"impact_offset_across"}),
        ('{{ impact.yaw | to("deg") }}', {"bird_yaw"}),
        ('{{ plate.material.young | to("MPa") }}', {"plate_modulus"}),
        ('{{ plate.material.density | to("t/mm^3") }}', {"plate_density"}),
        ('{{ plate.preload[0] | to("MPa") }} {{ plate.preload[1] | to("MPa") }}', {"plate_preload"}),
        (SPRINGS, {"clamp_rotation"}),
        ('{{ plate.material.rate_c | to("1/ms") }}', set()),  # one of the two keys is not enough
        ('{{ plate.material.rate_c | to("1/ms") }} {{ plate.material.rate_p }}', {"plate_rate_hardening"}),
    ],
)
def test_an_effect_needs_a_place_for_what_it_changes(tmp_path: Path, line: str, more: set[str]) -> None:
    assert carried(oscillator(tmp_path, deck=f"{DECK}$ {line}\n")) == OF_DECK | more


def test_our_own_solver_has_a_place_for_everything() -> None:
    case = load_case("reference_strike")
    assert carried(case) == set(effects())
    assert missing_in_deck(case, case.with_mesh(1000, (10, 8))) == ()


def test_what_has_no_place_is_named(tmp_path: Path) -> None:
    case = oscillator(tmp_path)
    assert unsupported_by_deck(case, "plate_rate_hardening") == (
        "the deck has no place for plate.material.rate_c, plate.material.rate_p"
    )
    assert unsupported_by_deck(case, "clamp_rotation") == "the deck has no place for plate.edges.rotational"
    assert missing_in_deck(case, case.with_mesh(1000, (12, 8))) == ("plate.elements[0]", "bird.particles")


def test_a_mesh_that_the_deck_makes_can_be_refined(tmp_path: Path) -> None:
    deck = DECK + "$ mesh {{ bird.particles }} {{ plate.elements[0] }} {{ solver.smoothing }}\n"
    case = oscillator(tmp_path, deck=deck)
    assert missing_in_deck(case, case.with_mesh(1000, (12, 8))) == ()
    assert missing_in_deck(case, case.overlaid({"solver": {"smoothing": 1.3, "courant": 0.5}})) == ("solver.courant",)


def test_an_effect_without_a_place_is_refused_before_anything_is_run(tmp_path: Path) -> None:
    path = written(tmp_path)
    path.write_text(path.read_text(encoding="utf-8") + '\n[effects]\nbird_friction = 0.1\nimpact_speed = "1 m/s"\n')
    with pytest.raises(CaseError) as caught:
        external_solver(load_case(path))
    assert list(caught.value.errors) == ["effects.bird_friction: the deck has no place for impact.friction"]


@pytest.mark.parametrize(
    "line", ['{{ velocity_normal | to("m/s") }}', '{{ impact.angle | to("deg") }}', "{{ impact.direction[2] }}"]
)
def test_an_angle_s_effect_is_carried_beside_a_direction(tmp_path: Path, line: str) -> None:
    path = written(tmp_path, deck=DECK.replace("(1.8 * velocity_normal)", "(1.8 * impact.speed)") + line)
    case = load_case(path, {"impact.direction": "[0.8, 0.3, -0.6]"})
    assert unsupported_by_deck(case, "impact_angle") == ""


def test_each_entry_of_a_list_needs_a_place_of_its_own(tmp_path: Path) -> None:
    half = oscillator(tmp_path / "half", deck=f"{DECK}$ {{{{ plate.preload[0] | to('MPa') }}}}\n")
    loaded = half.overlaid({"plate": {"preload": ["10 MPa", "20 MPa"]}})
    assert missing_in_deck(half, loaded) == ("plate.preload[1]",)
    assert unsupported_by_deck(half, "impact_offset") == "the deck has no place for impact.offset[0]"


def test_a_case_whose_keys_the_deck_cannot_change_is_refused(tmp_path: Path) -> None:
    case = oscillator(tmp_path)
    with pytest.raises(CaseError, match=r"the deck of strike.k.j2 has no place for impact.friction"):
        refuse_missing_in_deck(case, case.overlaid({"impact": {"friction": 0.2}}))
    refuse_missing_in_deck(case, case.overlaid({"plate": {"thickness": "9 mm"}}))
    assert has_place(case, "plate.thickness", 9e-3)
    assert not has_place(case, "bird.particles", 1000)
