"""Results show themselves: a line, a table, a picture, axes; and the report links to the page that lies beside it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot as plt

from birdstrike.data.errors import UserError
from birdstrike.data.histories import Histories
from birdstrike.doe.campaign.results import load_dataset
from birdstrike.inversion.results.inversion import Inversion
from birdstrike.reports.page.page import report
from tests.reports.html import Page

TIME = np.linspace(0.0, 2e-3, 201)
HISTORIES = Histories(
    TIME,
    {"displacement_centre": 5e-3 * np.sin(1500.0 * TIME), "<b>force": 1e3 * TIME},
    {"displacement_centre": "m", "<b>force": "N"},
)


def test_histories_show_channels_and_peaks() -> None:
    assert repr(HISTORIES) == "<Histories: 2 channels, 201 instants to 2 ms, peak of displacement_centre 5 mm>"
    shown = HISTORIES._repr_html_()
    assert "<td>displacement_centre</td>" in shown
    assert "&lt;b&gt;force" in shown
    assert "data:image/png;base64," in shown
    table = HISTORIES.to_dataframe()
    assert list(table) == ["time_s", "displacement_centre_m", "<b>force_N"]
    assert np.array_equal(table["displacement_centre_m"], HISTORIES.channels["displacement_centre"])
    gauge = Histories(TIME, {"strain_back": 6.0 * TIME}, {"strain_back": ""})
    assert gauge.headline.endswith("peak of strain_back 12000 µm/m"), "1.2e+04"
    assert "<td>12000</td>" in gauge._repr_html_()


def test_a_plot_of_a_channel_that_is_not_there_names_those_that_are(loop: Path) -> None:
    for found in (HISTORIES, load_dataset(loop / "doe")):
        with pytest.raises(UserError, match='no channel "displacement_center"; the channels are: displacement_centre'):
            found.plot("displacement_center")


def test_an_inversion_is_read_from_a_name_as_from_a_path(loop: Path) -> None:
    path = loop / "inversion" / "inversion.json"
    assert repr(Inversion.load(str(path))) == repr(Inversion.load(path)) == repr(Inversion.load(path.parent))
    for wrong in (loop / "inversion" / "nope.json", loop / "doe"):
        with pytest.raises(UserError, match="there is no such file; birdstrike train-and-invert writes it"):
            Inversion.load(wrong)
    with pytest.raises(UserError, match="path = 3 is no path"):
        Inversion.load(3)  # pyright: ignore[reportArgumentType]


def test_a_plot_is_in_engineers_units_on_the_axes_given() -> None:
    axes = plt.subplots()[1]
    assert HISTORIES.plot("displacement_centre", axes) is axes
    assert axes.lines[0].get_ydata() == pytest.approx(1e3 * HISTORIES.channels["displacement_centre"])
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("time [ms]", "displacement centre [mm]")
    plt.close("all")


def test_a_campaign_shows_its_runs(loop: Path) -> None:
    dataset = load_dataset(loop / "doe")
    assert repr(dataset).startswith("<Dataset: 16 runs over viscosity, pressure_cutoff")
    table = dataset.to_dataframe()
    assert table["peak_displacement_centre_m"].to_numpy() == pytest.approx(
        dataset.curves["displacement_centre"].max(axis=1)
    )
    assert len(dataset.plot("displacement_centre").lines) == 16
    assert "4 more rows" in dataset._repr_html_()
    plt.close("all")


def test_an_inversion_shows_what_is_identified(loop: Path) -> None:
    found = Inversion.load(loop / "inversion" / "inversion.json")
    viscosity = found.methods["emulator"].parameters["bird.material.viscosity"]
    assert f"viscosity {viscosity.value:.3g} Pa s (95 %: " in repr(found)
    assert "pressure cutoff not identifiable" in repr(found)
    table = found.to_dataframe().set_index("parameter")
    assert table.loc["bird.material.viscosity", "value"] == viscosity.value
    assert [label.get_text() for label in found.plot().get_yticklabels()][:2] == ["viscosity", "pressure cutoff"]
    assert "<table" in found._repr_html_()
    with pytest.raises(UserError, match="no draws of a posterior"):
        found.to_inference_data(loop / "inversion")
    plt.close("all")


def test_the_report_links_to_the_page_beside_it(
    loop: Path, page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("birdstrike.reports.page.page.SECTIONS", ())
    beside = Page(report(loop, loop / "report.html", models=False).read_text(encoding="utf-8"))
    assert page.name in beside.references
    alone = Page(report(loop, tmp_path / "report.html", models=False).read_text(encoding="utf-8"))
    assert page.name not in alone.references
