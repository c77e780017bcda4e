"""Numbers in sentences: an interval that has a width is never written as one number."""

from __future__ import annotations

from birdstrike.data.formatting import fewest_decimals, instant, listing, quantity, reading, signed_ms, span
from birdstrike.data.units import to_si
from birdstrike.reports.figures.quantities import bound
from birdstrike.reports.figures.quantities import quantity as page_quantity


def test_an_interval_has_as_many_digits_as_its_ends_need() -> None:
    assert span(555.4, 643.2, "Pa s") == "555 .. 643 Pa s"
    assert span(1596.6, 1602.8, "m/s") == "1597 .. 1603 m/s"
    assert span(1600.0, 1600.0, "m/s") == "1600 .. 1600 m/s"


def test_a_strain_is_shown_in_microstrain_and_a_pure_number_as_it_is_written() -> None:
    """Strains stood in sentences and on axes as bare ratios: `0.00501`."""
    assert [reading(value, "", 3) for value in (0.00501, -3.2e-5)] == ["5010 µm/m", "-32 µm/m"]
    assert to_si(reading(0.00501, ""), "") == 0.00501, "what is shown can be typed"
    assert quantity(0.2, "") == "0.2", "a failure strain, a gain"
    assert [quantity(-0.0, "m"), page_quantity(-0.0, "m"), bound(-0.0, "Pa")] == ["0 mm", "0 mm", "0 MPa"]
    assert [quantity(938.0, "kg/m^3"), to_si("938 kg/m³", "kg/m^3")] == ["938 kg/m³", 938.0]


def test_a_shift_of_a_clock_has_the_digits_that_tell_it_from_nothing() -> None:
    assert signed_ms(1.234567e-5) == "+0.012 ms"
    assert signed_ms(-4.2e-8) == "-0.000042 ms", "it was printed as -0.000"
    assert signed_ms(4.2e-8, 2e-5) == "+0.000 ms", "nothing beside its interval"
    assert signed_ms(1.23456e-5, 3e-7) == "+0.01235 ms"
    assert signed_ms(0.0) == "+0.000 ms"


def test_an_instant_can_be_found_in_its_record_however_far_off_its_clock() -> None:
    assert instant(1.59e-3, 3e-3) == "1.59 ms"
    assert instant(12.50155, 3.7e-3) == "12501.55 ms", "it was 1.25e+04 ms"
    assert instant(0.0, 0.0) == "0 ms"


def test_a_shift_is_written_with_the_fewest_decimals_that_give_it() -> None:
    assert fewest_decimals(-1.7e9) == "-1700000000"
    assert fewest_decimals(1.7e9 + 0.25) == "1700000000.25"
    assert fewest_decimals(-12.499) == "-12.499"
    assert fewest_decimals(1.23456789e-5) == "0.000012346"
    assert fewest_decimals(0.0) == "0"
    assert fewest_decimals(1.7e18) == "1700000000000000000"
    assert fewest_decimals(-1.5e21) == "-1500000000000000000000"


def test_a_list_names_all_or_says_how_many_more_there_are() -> None:
    letters = list("abcde")
    assert [listing(letters[:n]) for n in range(4)] == ["", "a", "a and b", "a, b and c"]
    assert [listing(letters[:n], 3) for n in (2, 3, 5)] == ["a and b", "a, b and c", "a, b, c and 2 more"]
