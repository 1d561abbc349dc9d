"""The sections of docs/validation.md: text around numbers that are computed on the spot."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.heights.validity import GENTLE_SLOPE, STEEP_SLOPE

from .cases import MATERIALS, PERIODS, PROBE_GRATING, PROFILES, Grating
from .closed_forms import ANGLES, deviations
from .compare import GRAZING, Comparison, angles_of, gratings_of, table_of
from .limits import GENTLE_ERROR, STEEP_ERROR, STEEPEST_LIGHT, rms_slope, slope_limit
from .markdown import joined, percent, sentence_case, table
from .second import agreement
from .solutions import CONVERGED, shipped
from .statistics import Statistics

Measure = Callable[[Comparison], float]


def introduction() -> str:
    """What is compared, and how."""
    return f"""# How far the model holds

Written by `make validation`, which computes every number and picture below from the package itself.
What it is compared with was made by others: closed forms from optics, and rigorous solutions of
Maxwell's equations by `gratinglab` (boundary integrals) and `pySCATMECH` (coupled waves), which
come with the package as data. `python -m docs.make.validation solve` makes those anew.

A grating's order m carries the power of its lobe of the BRDF. Through a window much wider than the
period, ∫ f cosθo dωo over that lobe is

    η_m = R(cosθ_half) · (1 + ωi·ω_m)² / (w² cosθi cosθ_m) · |a_m(k w)|²,   w = cosθi + cosθ_m,

since dωo = dα dβ/(k² cosθo) and ∬ exp(−σ²|q − q_m|²) dα dβ = π/σ². Below, η_m is the value of
`md.reference.brdf` at the centre of the lobe, times π/(σk)² and Fresnel's reflectance: the raw
model, with `energy_conserving` false.

*Deviation* is Σ|η − η_rigorous| / Σ η_rigorous over the wavelengths and the orders that leave
within {GRAZING:g}° of the normal, for unpolarised light; *of colours* leaves out order 0."""


def closed_forms(chosen: Sequence[tuple[float, float]]) -> str:
    """Order powers of ideal gratings of these periods and depths, µm."""
    rows = []
    for profile in PROFILES:
        found = [deviations(Grating(profile, period, depth)) for period, depth in chosen]
        integral = max(item.integral for item in found)
        by_table = max(item.table for item in found)
        orders = sum(item.orders for item in found)
        rows.append([profile, orders, f"{integral:.1e}", f"{by_table:.1e}"])
    return f"""## Closed forms

Largest absolute error of an order's power |a_m|² (all orders together carry 1): light and orders up
to {ANGLES[-1]:g}° from the normal; period and depth {_pairs(chosen)} µm; 410 to 760 nm, 512 pixels
a period. What is left of lamellar and blazed gratings is their sampling.

{table(["profile", "orders", "`reference.brdf`", "table"], rows)}"""


def solutions(comparisons: dict[str, Comparison]) -> str:
    """How good the rigorous solutions are."""
    rows = []
    for material in MATERIALS:
        every = shipped(material)
        change = every.change
        rows.append(
            [
                f"{material} ({every.about['index']})",
                sum(len(gratings_of(comparisons[material], p)) for p in PROFILES),
                len(change),
                *(f"{value:.0e}" for value in (*np.quantile(change, (0.5, 0.99)), change.max())),
                f"{every.balance.max():.0e}",
                percent(1 - float(np.mean(every.converged))),
            ]
        )
    header = [
        "material (index)", "gratings", "orders", "change: median", "99 %", "largest",
        "energy missed", "left out",
    ]  # fmt: skip
    pairs = [
        [
            part.label,
            part.orders,
            f"{part.strongest:.2g}",
            *(f"{value:.0e}" for value in (part.median, part.largest, part.own_change)),
        ]
        for part in agreement()
    ]
    return f"""## The rigorous solutions

Sinusoidal, lamellar (half high) and blazed gratings; periods {joined(PERIODS)} µm, depths 0.05 to
0.4 µm, light from 0° to 75°, on blazed ones from both sides, both polarisations; solver:
{shipped("perfect").about["solver"]}. Each was solved on two meshes, the second twice as fine (1.4
times where light in the metal is short), and on a third, twice as fine again, where the second had
changed an order by more than {CONVERGED:g}. *Change* is what the last step did to an efficiency
(absolute), *energy missed* by how much all orders and the absorption fail to add up to 1. A
solution with an order that still changed by more than {CONVERGED:g} is left out.

{table(header, rows)}

Two methods beside each other, the second {shipped("keratin", "coupled_wave").about["solver"]}.
Coupled waves on a staircase do not converge for TM light on metal: there only TE is compared, and
both polarisations on lamellar gratings, which need no staircase. Absolute differences of
efficiencies, and by how much the second method itself changed when its orders and layers doubled:

{table(["case", "orders", "strongest", "difference: median", "largest", "own change"], pairs)}"""


def probe(perfect: Comparison) -> str:
    """The grating that the design was checked with."""
    grating = Grating(*PROBE_GRATING)
    part = perfect.where(profile=grating.profile, period=grating.period, depth=grating.depth)
    straight = part.where(theta=0.0)
    wavelength = straight.solutions.rows["wavelength"]
    to_550 = straight.select(wavelength <= 550).largest_relative()
    from_450 = straight.select(wavelength >= 450).largest_relative()
    rows = []
    for theta in angles_of(part):
        at = part.where(theta=theta)
        values = (at.largest_relative(), at.deviation(), at.deviation(colours=True), at.gain() - 1)
        rows.append([f"{theta:g}°", *map(percent, values)])
    header = [
        "incidence",
        "largest relative, orders −2 to 2",
        "deviation",
        "of colours",
        "light gained",
    ]
    return f"""## A gentle grating

A sinusoid of period {grating.period:g} µm and depth {grating.depth:g} µm, RMS slope
{rms_slope(grating):.3f}; perfect conductor, unpolarised. At normal incidence none of the orders −2
to 2 is off by more than {percent(to_550)} of its own power up to 550 nm, and {percent(from_450)}
from 450 to {wavelength.max():g} nm. The error grows with the angle:

{table(header, rows)}

![Efficiencies of three gratings against wavelength](images/validation_orders.png)"""


def slopes(perfect: Comparison) -> str:
    """Deviation against slope, and the warnings."""
    angles = angles_of(perfect.where(profile="sinusoidal"))
    sinusoids = gratings_of(perfect, "sinusoidal")
    values = table_of(perfect, sinusoids, angles, _of_colours)
    gentle, steep = (slope_limit(perfect, error) for error in (GENTLE_ERROR, STEEP_ERROR))
    return f"""## Slope decides

The deviation of sinusoids grows with the RMS slope; at one slope it is larger where the period is
narrow. Deviation of colours:

{_grating_table(sinusoids, angles, values, slopes=True)}

![Deviation against RMS slope](images/validation_slopes.png)

The package warns by this rule: a limit is the slope of the last sinusoid before the first that
deviates by more than {percent(GENTLE_ERROR)}, or {percent(STEEP_ERROR)}, at any incidence up to
{STEEPEST_LIGHT:g}°, in all orders or in the colours alone. Here the limits are {gentle:.3f} and
{steep:.3f}; the warnings begin at {GENTLE_SLOPE:g} and {STEEP_SLOPE:g}. Beyond {STEEPEST_LIGHT:g}°
expect more at any slope, and more of a dielectric (see Materials)."""


def edges(perfect: Comparison) -> str:
    """Lamellar and blazed gratings."""
    parts = []
    for profile in ("lamellar", "blazed"):
        angles = angles_of(perfect.where(profile=profile))
        gratings = gratings_of(perfect, profile)
        values = table_of(perfect, gratings, angles, _of_colours)
        parts.append(f"{sentence_case(profile)}:\n\n{_grating_table(gratings, angles, values)}")
    text = """## Edges

Vertical walls reflect light too, and the model knows nothing of it. Deviation of colours, perfect
conductor. Blazed gratings ascend towards +x: at positive angles the light falls on their steps, at
negative ones along the facets."""
    return "\n\n".join([text, *parts])


def polarisation(perfect: Comparison) -> str:
    """The model against one polarisation at a time."""
    sinusoids = perfect.where(profile="sinusoidal")
    angles = angles_of(sinusoids)
    rows = []
    for period, depth in ((5.0, 0.1), PROBE_GRATING[1:], (1.6, 0.2), (1.1, 0.4)):
        grating = Grating("sinusoidal", period, depth)
        for light in ("te", "tm"):
            values = table_of(sinusoids, [grating], angles, _of_light(light))[0]
            rows.append([str(grating), light.upper(), *map(percent, values)])
    return f"""## Polarisation

The model knows none, and stands for the mean. Held against one polarisation at a time (TE: the
electric field along the grooves) it is further off. Deviation of all orders, perfect conductor:

{table(["grating", "light", *(f"{theta:g}°" for theta in angles)], rows)}"""


def materials(comparisons: dict[str, Comparison]) -> str:
    """Metal and dielectric beside the perfect conductor."""
    angles = (0.0, 30.0, 60.0)
    rows = []
    for profile in PROFILES:
        for period, depth in ((2.5, 0.1), (1.1, 0.1), (2.5, 0.4), (1.1, 0.4)):
            grating = Grating(profile, period, depth)
            for material in MATERIALS:
                values = table_of(comparisons[material], [grating], angles, _of_colours)[0]
                rows.append([str(grating), material, *map(percent, values)])
    keratin = comparisons["keratin"].where(profile="sinusoidal")
    gentle = [g for g in gratings_of(keratin, "sinusoidal") if rms_slope(g) <= 1.05 * GENTLE_SLOPE]
    least, most = (
        percent(float(at_60(table_of(keratin, gentle, [60.0], _of_colours))))
        for at_60 in (np.min, np.max)
    )
    return f"""## Materials

Fresnel's reflectance at the half vector, once, stands for the boundary conditions. On aluminium
that does about as well as on a perfect conductor. A dielectric reflects the two polarisations so
differently at oblique angles that it does not, however gentle the slope: the colours of sinusoids
with slopes up to {GENTLE_SLOPE:g} are off by {least} to {most} on keratin at 60°. Deviation of
colours; aluminium and keratin at 460 and 610 nm.

{table(["grating", "material", *(f"{theta:g}°" for theta in angles)], rows)}

![Every order: model against rigorous efficiency](images/validation_materials.png)"""


def random_surfaces(measured: Statistics) -> str:
    """Statistics of random surfaces and windows."""
    specular, offsets = measured.specular, measured.offsets
    estimates = zip(
        specular.kappa_rms, specular.power.mean, specular.power.error, specular.exact, strict=True
    )
    rows = [
        [f"{x:g}", f"{mean:.4f} ± {error:.4f}", f"{exact:.4f}", f"{(mean - exact) / error:+.1f}"]
        for x, mean, error, exact in estimates
    ]
    lobes = []
    for lobe in measured.lobes:
        name = f"{1000 * lobe.roughness.rms:g} nm"
        lobes.append([name, *_distances(lobe.measured.distance(lobe.exact))])
    lobes.append(["mean of patches", *_distances(offsets.patches.distance(offsets.ensemble))])
    return f"""## Random surfaces

Gaussian heights, autocorrelation rms²·exp(−r²/T²), seeded. Left: mean power of order 0, which is
exp(−(κ·rms)²) and the little that is scattered into the same bin. Middle: the scattered lobe of
`md.reference.brdf`, against Beckmann and Spizzichino's series (lines). Right: `patch`, averaged
over windows at {offsets.count} random places of one surface, against its `ensemble`.

![Specular loss, scattered lobes, and the mean of patches](images/validation_statistics.png)

{table(["κ·rms", f"mean of {specular.surfaces} surfaces", "exact", "in standard errors"], rows)}

Distances in standard errors over the directions of the picture: of scattered lobes from the closed
form, and of the mean of patches from the ensemble. Of their root-mean-square 1 is expected.

{table(["rms", "directions", "root-mean-square", "largest"], lobes)}"""


def _of_colours(part: Comparison) -> float:
    return part.deviation(colours=True)


def _of_light(name: str) -> Measure:
    def deviation(part: Comparison) -> float:
        exact = part.solutions.rows[name].astype(float)[part.counted]
        return float(np.abs(part.model[part.counted] - exact).sum() / exact.sum())

    return deviation


def _grating_table(
    gratings: Sequence[Grating],
    angles: Sequence[float],
    values: NDArray[np.float64],
    *,
    slopes: bool = False,
) -> str:
    header = ["period, depth", *(["RMS slope"] if slopes else []), *(f"{t:g}°" for t in angles)]
    rows = [
        [
            f"{grating.period:g}, {grating.depth:g} µm",
            *([f"{rms_slope(grating):.3f}"] if slopes else []),
            *map(percent, row),
        ]
        for grating, row in zip(gratings, values, strict=True)
    ]
    return table(header, rows)


def _distances(z: NDArray[np.float64]) -> list[object]:
    return [len(z), f"{np.sqrt(np.mean(z**2)):.2f}", f"{np.abs(z).max():.1f}"]


def _pairs(values: Sequence[tuple[float, float]]) -> str:
    texts = [f"{period:g} and {depth:g}" for period, depth in values]
    return " or ".join(texts)
