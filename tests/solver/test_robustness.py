"""What must not happen in a strike, made to happen: each ends in a sentence that names the field to change."""

from __future__ import annotations

import copyreg
import pickle
import re
from types import TracebackType

import numpy as np
import pytest

from birdstrike.data.errors import CaseError, RunFailed
from birdstrike.solver.bird.body import BirdBody
from birdstrike.solver.case.case import Case, load_case
from birdstrike.solver.checks import BALANCE_LIMIT, run_checks
from birdstrike.solver.contact import Contact
from birdstrike.solver.coupling import Coupling
from birdstrike.solver.simulate import PlateState, simulate
from birdstrike.solver.target.assembly import Target

TINY = {
    "bird.particles": "120",
    "plate.elements": "[6, 6]",
    "time.end": "0.3 ms",
    "time.snapshots": "[]",
    "impact.standoff": "1 mm",
}


def tiny(**changes: str) -> Case:
    return load_case("reference_strike_156mm", TINY | {k.replace("__", "."): v for k, v in changes.items()})


def in_contact(**changes: str) -> Coupling:
    """A strike in which some particles touch the plate."""
    strike = Coupling(tiny(**changes))
    while not strike.contact.touching:
        strike.advance()
        strike.move()
    return strike


def go_on(strike: Coupling, steps: int) -> None:
    """Further steps, each judged."""
    for _ in range(steps):
        strike.advance()
        strike.audit()


@pytest.mark.parametrize("factor", [2.5, 6.0, 40.0])
def test_a_courant_violation_names_the_courant_number(factor):
    """No case can ask for it (solver.courant ends at 1), so the stable step itself is multiplied."""
    with pytest.raises(RunFailed, match=r"lower solver\.courant"):
        simulate(tiny(), step_factor=factor)


@pytest.mark.parametrize("held", [None, PlateState(strain=1.0)])
def test_a_run_that_fails_crosses_a_process_border(monkeypatch, held):
    """With and without the plate's state in it; a failure that is its own cause sends reducers of exceptions round."""
    if held:
        monkeypatch.setattr("birdstrike.solver.simulate.PlateState", lambda: held)
        monkeypatch.setattr(held, "note", lambda _: None, raising=False)
    with pytest.raises(RunFailed) as caught:
        simulate(tiny(), step_factor=40.0)
    failure = caught.value
    assert failure.__cause__ is not failure
    assert ("given way" in failure.reason) == (held is not None)
    reducers = pytest.importorskip("tblib.pickling_support")
    monkeypatch.setitem(copyreg.dispatch_table, RunFailed, reducers.pickle_exception)
    monkeypatch.setitem(copyreg.dispatch_table, TracebackType, reducers.pickle_traceback)
    again = pickle.loads(pickle.dumps(failure))
    assert (again.reason, again.remedy) == (failure.reason, failure.remedy)


def test_a_courant_number_above_1_is_refused():
    with pytest.raises(CaseError, match=r"solver\.courant = 1\.5 is outside 0\.05 \.\. 1"):
        tiny(solver__courant="1.5")


def test_an_exploding_contact_names_its_remedy():
    """A spring 1e4 times too stiff for the step throws the first layer back: the balance sees it at the next audit."""
    strike = in_contact()
    strike.contact.stiffness *= 1e4
    with pytest.raises(
        RunFailed, match=r"energy balance is off by .*lower solver\.courant \(or refine bird\.particles\)"
    ):
        go_on(strike, 100)


def test_a_force_that_appears_at_depth_creates_energy():
    """Particles set into the plate, not flown into it: their springs' k/2 d^2 is in no energy but that of contact."""
    strike = in_contact()
    go_on(strike, 1)
    contact, balance = strike.contact, strike.balance
    assert balance.contact_created(contact) < 1e-3
    strike.bird.x[: strike.bird.n, 2] -= 0.1 * contact.spacing
    contact.update_forces(strike.bird, strike.plate)
    sheet = contact.sheets[0]
    depth = np.maximum(sheet.gap[0] - sheet.foot[sheet.watched, 2], 0.0)
    springs = 0.5 * contact.stiffness * float((depth**2).sum())
    created = (springs - contact.energies["contact"]) / balance.normal_energy
    assert balance.contact_created(contact) == pytest.approx(created, rel=1e-9)
    assert created > BALANCE_LIMIT
    assert balance.worst < BALANCE_LIMIT, "the energy balance alone has not seen it"
    with pytest.raises(RunFailed, match=r"contact created .* of the normal kinetic energy .*refine plate\.elements"):
        run_checks(strike)


def test_a_run_whose_contact_creates_energy_fails(monkeypatch: pytest.MonkeyPatch):
    """Springs that give back 3 % of the normal kinetic energy too much, and no other energy shows it."""
    monkeypatch.setattr("birdstrike.solver.energy_balance.Balance.contact_created", lambda *_: 0.03)
    with pytest.raises(RunFailed, match=r"contact created 3\.0% .*refine plate\.elements or bird\.particles"):
        simulate(tiny())


def test_a_balance_that_is_off_names_a_courant_number_that_mends_it(monkeypatch: pytest.MonkeyPatch):
    """A shallow strike, whose normal energy is little: refused under a limit of half its error, and then not."""
    shallow = {"impact__angle": "15 deg", "plate__length": "600 mm"}
    error = simulate(tiny(**shallow)).summary["worst_energy_error"]
    monkeypatch.setattr("birdstrike.solver.checks.BALANCE_LIMIT", 0.5 * error)
    with pytest.raises(RunFailed, match=r"lower solver\.courant to 0\.\d+ or refine bird\.particles") as caught:
        simulate(tiny(**shallow))
    named = re.search(r"courant to (0\.\d+)", caught.value.remedy)
    assert named is not None
    assert 0.4 < float(named[1]) < 0.6
    assert simulate(tiny(**shallow, solver__courant=named[1])).summary["worst_energy_error"] < 0.5 * error


def test_a_balance_that_is_off_with_the_shortest_step_names_the_mesh_alone():
    """It said to lower solver.courant to 0.05, which it was."""
    strike = Coupling(tiny(solver__courant="0.05"))
    strike.balance.worst = 0.5
    with pytest.raises(RunFailed) as caught:
        run_checks(strike)
    assert caught.value.remedy == "refine bird.particles and plate.elements"


def test_friction_that_gives_energy_fails_the_run(monkeypatch: pytest.MonkeyPatch):
    """Turned round on every tenth particle: the others' heat and the energy balance hide it."""
    strike = in_contact(impact__friction="0.3")
    friction, balance = strike.contact.friction, strike.balance
    assert friction is not None
    sound, every_tenth = friction.update_forces, slice(None, None, 10)

    def turned_round(contact: Contact, bird: BirdBody, plate: Target) -> None:
        sound(contact, bird, plate)
        change = -2.0 * friction.own[0][every_tenth]
        for forces in (friction.own[0], friction.on_bird, contact.on_bird):
            forces[every_tenth] += change

    def go(steps: int) -> None:
        for _ in range(steps):
            strike.advance()
            strike.audit() if strike.at_bird else strike.move()

    go(120)
    assert balance.friction_created(strike.contact) < 1e-6
    run_checks(strike)
    monkeypatch.setattr(friction, "update_forces", turned_round)
    go(120)
    assert balance.worst < BALANCE_LIMIT
    assert 1e-4 < balance.friction_created(strike.contact) < balance.energy["friction"] / balance.normal_energy
    with pytest.raises(RunFailed, match=r"friction created 0\.\d+% .*\(limit 0\.01%\); lower solver\.courant"):
        run_checks(strike)


def test_a_bird_through_the_plate_names_its_remedy():
    strike = in_contact()
    strike.bird.x[:, 2] -= strike.contact.gap
    with pytest.raises(RunFailed, match=r"passed the plate's mid-surface; lower solver\.courant or refine bird\.part"):
        strike.advance()


def test_a_density_that_is_not_positive_names_its_remedy():
    """Particles that fly apart faster than one volume a step."""
    strike = Coupling(tiny())
    for _ in range(strike.stride):
        strike.advance()
        strike.move()
    strike.bird.v[:] = 0.8 / (strike.stride * strike.dt) * (strike.bird.x - strike.bird.x.mean(axis=0))
    with pytest.raises(RunFailed, match=r"density is no longer positive; lower solver\.courant"):
        strike.advance()


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize(("body", "field"), [("bird", "x"), ("bird", "v"), ("plate", "x"), ("plate", "v")])
def test_what_is_not_finite_ends_the_run(body, field, value):
    """At the latest at the next audit, from whichever array it comes."""
    strike = in_contact()
    array = getattr(getattr(strike, body), field)
    array[len(array) // 2] = value
    with np.errstate(all="ignore"), pytest.raises(RunFailed, match=r"solver\.courant"):
        go_on(strike, strike.stride)


@pytest.mark.parametrize(
    ("changes", "warning"),
    [
        ({"impact__standoff": "400 mm"}, "shorten impact.standoff or lengthen time.end"),
        (
            {"impact__angle": "8 deg", "plate__length": "60 mm", "impact__standoff": "0 mm"},
            "beside the plate",
        ),
    ],
)
def test_a_bird_that_misses_is_a_clear_warning(changes, warning):
    missed = simulate(tiny(**changes))
    assert any(warning in text for text in missed.summary["warnings"])
    assert missed.summary["momentum_error"] < 1e-10


def test_a_bird_cannot_start_inside_the_plate():
    """The stand-off is measured from the first touch and refuses to be negative; at zero nothing overlaps yet."""
    with pytest.raises(CaseError, match=r"impact\.standoff = -5 mm is outside 0 mm"):
        tiny(impact__standoff="-5 mm")
    for thickness, angle in (("50 mm", "90 deg"), ("0.5 mm", "20 deg")):
        strike = Coupling(tiny(impact__standoff="0 mm", plate__thickness=thickness, impact__angle=angle))
        strike.advance()
        assert strike.deepest < 1e-9


def test_a_bird_put_inside_the_plate_ends_in_a_remedy():
    strike = Coupling(tiny())
    strike.bird.x[:, 2] -= strike.bird.x[:, 2].min() + 0.6 * strike.contact.gap
    with pytest.raises(RunFailed, match=r"solver\.courant or refine bird\.particles"):
        strike.advance()


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"plate__elements": "[0, 6]"}, "plate.elements.0 = 0 is outside 2 .. 400"),
        ({"plate__elements": "[]"}, "plate.elements"),
        ({"bird__particles": "0"}, "bird.particles = 0 is outside 100 .. 200000"),
        ({"bird__particles": "-5"}, "bird.particles = -5 is outside 100 .. 200000"),
    ],
)
def test_no_elements_is_refused_by_name(changes, message):
    with pytest.raises(CaseError, match=re.escape(message)):
        tiny(**changes)


def test_an_equation_of_state_that_softens_is_refused_with_its_section():
    """p = 200 mu - 900 mu^2 MPa falls beyond mu = 0.11: no shock of 286 m/s stands on it."""
    soft = {"kind": "linear_polynomial", "C1": "200 MPa", "C2": "-900 MPa"}
    eos = {f"bird__material__eos__{key}": text for key, text in soft.items()}
    case = tiny(**eos, impact__speed="373 m/s", impact__angle="50 deg")
    with pytest.raises(CaseError, match=r"bird\.material\.eos has no shock of 285\.7 m/s.*or lower impact\.speed"):
        simulate(case)


def test_a_plate_that_gave_way_is_named_as_the_cause():
    told = str(PlateState(strain=0.4, sag=0.3).explained(RunFailed("unstable", "lower solver.courant")))
    assert "the plate had given way (deflected by 30% of its shorter side, strained by 40%)" in told
    assert "a thicker plate.thickness or a lower impact.speed; otherwise lower solver.courant" in told


def test_the_state_is_that_of_the_plate():
    """3 kg at 318 m/s on a sheet of 1.25 mm: it sags and strains."""
    soft = {
        "plate.length": "100 mm", "plate.width": "192 mm", "plate.thickness": "1.25 mm", "plate.elements": "[2, 5]",
        "plate.edges": "pinned", "bird.diameter": "106 mm", "impact.speed": "318 m/s", "impact.angle": "78 deg",
    }  # fmt: skip
    strike, state = Coupling(load_case("reference_strike", TINY | soft | {"time.end": "0.3 ms"})), PlateState()
    for _ in range(strike.steps):
        strike.advance()
        strike.move()
    state.note(strike)
    assert state.sag > 0.2
    assert state.strain > 0.05


def test_a_plate_that_held_changes_no_message():
    failure = RunFailed("unstable", "lower solver.courant")
    assert PlateState(strain=0.1, sag=0.05).explained(failure) is failure
