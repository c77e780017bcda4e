"""The same strike with a Lagrangian bird of hexahedra beside the SPH bird."""

from __future__ import annotations

from birdstrike.reports.verification.draw import Curve, Panel, draw
from birdstrike.reports.verification.openradioss import SOURCE, VARIANTS, compare, reference
from birdstrike.reports.verification.problem import Outcome, Picture, Problem, Strikes
from birdstrike.reports.verification.rows import below, shown

SPH = VARIANTS["viscous"]
LAGRANGIAN = SPH.with_(bird__method="hexahedra")


def solve(strikes: Strikes) -> Outcome:
    """Displacement and momentum of both discretisations, beside OpenRadioss's SPH."""
    truth = reference("viscous")
    sph, hexahedra = compare(strikes[SPH], truth), compare(strikes[LAGRANGIAN], truth)
    apart = 100.0 * float(((hexahedra.w - sph.w) ** 2).mean() ** 0.5) / sph.peak
    given = 100.0 * abs(hexahedra.final / sph.final - 1.0)
    summary = strikes[LAGRANGIAN].summary
    figure = "lagrangian"
    books = 100.0 * summary["worst_energy_error"]
    rows = (
        below("Lagrangian less SPH: displacement RMS of peak", apart, None, "%", "our SPH bird", "", figure),
        below("Lagrangian less SPH: momentum by 3 ms", given, None, "%", "our SPH bird", "", figure),
        below("Lagrangian: displacement RMS of peak", hexahedra.w_rms, None, "%", SOURCE, "", figure),
        below("Lagrangian: energy, worst instant", books, 1.0, "%", "energies, each from its own rate", "", figure),
        below("Lagrangian: linear momentum", summary["momentum_error"], 1e-10, "", "conservation", "", figure),
        shown("Lagrangian: mass eroded", 100.0 * summary["eroded_mass_fraction"], "%", "by distortion", "", figure),
    )
    time = 1e3 * truth.time
    panels = [
        Panel("time [ms]", label, [Curve(name, time, scale * getattr(run, field)) for name, run in runs])
        for runs in [(("SPH", sph), ("Lagrangian hexahedra", hexahedra))]
        for label, field, scale in (
            ("centre displacement [mm]", "w", 1e3),
            ("momentum given to the plate [N s]", "J", 1.0),
        )
    ]
    caption = (
        f"The viscous strike with both birds: peaks {1e3 * sph.peak:.2f} mm (SPH) and {1e3 * hexahedra.peak:.2f} mm "
        f"(hexahedra), {apart:.1f} % of the peak apart (RMS); momentum {sph.final:.1f} and {hexahedra.final:.1f} N s."
    )
    return Outcome(rows, (Picture(figure, draw(*panels), caption),))


ABOUT = "Fluid hexahedra tangle at 30 degrees and erode by distortion, which particles do not; the mass lost is stated."
PROBLEMS = (Problem("lagrangian", "Lagrangian against SPH", ABOUT, solve, (SPH, LAGRANGIAN)),)
