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
What it is compared with are closed forms from optics, and rigorous solutions of Maxwell's equations
by `gratinglab` (boundary integrals), `pySCATMECH` and `grcwa` (coupled waves) and by Rayleigh's
expansion, kept as data in docs/make/validation/data with what made them. `python -m
docs.make.validation solve`, `patches` and `coated` make those anew. `python -m docs.make.validation
groups` prints the first three sections alone.

A grating's order m carries the power of its lobe of the BRDF. Through a window much wider than the
period, ∫ f cosθo dωo over that lobe is

    η_m = 4 cosθi cosθ_m N / w² · |a_m(k w)|²,   w = cosθi + cosθ_m,

since dωo = dα dβ/(k² cosθo) and ∬ exp(−σ²|q − q_m|²) dα dβ = π/σ²; N is the mean power of the Jones
matrix ([theory.md](theory.md#the-material)), R (1 + ωi·ω_m)²/(2 cosθi cosθ_m)² by Kirchhoff. Below,
η_m is the value of `md.reference.brdf` at the centre of the lobe, times π/(σk)²: the raw model,
with `energy_conserving` false.

*Deviation* is Σ|η − η_rigorous| / Σ η_rigorous over the wavelengths and the orders that leave
within {GRAZING:g}° of the normal, for unpolarised light unless a polarisation is named; *of
colours* leaves out order 0. The *default* is `model="small_slope"`, on a bare dielectric with the
second order as tables hold it. A perfect conductor has no index, and is Kirchhoff's alone."""


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


def solutions(comparisons: dict[str, Comparison], patches: str) -> str:
    """How good the rigorous solutions are.

    patches : the same of those in two dimensions.
    """
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

{table(["case", "orders", "strongest", "difference: median", "largest", "own change"], pairs)}

{patches}

![Every order: default model against rigorous efficiency](images/validation_materials.png)"""


_OBLIQUE = (0.0, 30.0, 60.0)


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
    return f"""## A gentle grating of a perfect conductor

A perfect conductor takes Kirchhoff's model. A sinusoid of period {grating.period:g} µm and depth
{grating.depth:g} µm, RMS slope {rms_slope(grating):.3f}, unpolarised. At normal incidence none of
the orders −2 to 2 is off by more than {percent(to_550)} of its own power up to 550 nm, and
{percent(from_450)} from 450 to {wavelength.max():g} nm. The error grows with the angle:

{table(header, rows)}

![Efficiencies of three gratings against wavelength](images/validation_orders.png)"""


def slopes(kirchhoff: dict[str, Comparison], default: dict[str, Comparison]) -> str:
    """Deviation against slope, and the warnings."""
    rows = []
    for material in default:
        for grating in sorted(gratings_of(default[material], "sinusoidal"), key=rms_slope):
            rows.append(
                [
                    f"{material}, {grating.period:g}/{grating.depth:g} µm",
                    f"{rms_slope(grating):.3f}",
                    *_side_by_side(kirchhoff[material], default[material], grating, _OBLIQUE),
                ]
            )
    parts = list(default.values())
    gentle, steep = (slope_limit(parts, error) for error in (GENTLE_ERROR, STEEP_ERROR))
    header = ["sinusoid", "RMS slope", *(f"{theta:g}°" for theta in _OBLIQUE)]
    return f"""## Slope decides

The deviation of sinusoids grows with the RMS slope; at one slope it is larger where the period is
narrow, and in oblique light. Deviation of colours, Kirchhoff / default:

{table(header, rows)}

![Deviation against RMS slope](images/validation_slopes.png)

The package warns by this rule: a limit is the largest slope below that of the first sinusoid, of
either material, whose colours deviate by more than {percent(GENTLE_ERROR)}, or
{percent(STEEP_ERROR)}, by the default model at any incidence up to {STEEPEST_LIGHT:g}°. Here the
limits are {gentle:.3f} and {steep:.3f}; the warnings begin at {GENTLE_SLOPE:g} and
{STEEP_SLOPE:g}. Cuts of scales behave alike (above). Beyond {STEEPEST_LIGHT:g}° expect more at any
slope. An RMS slope knows no edges: blazed gratings, whose steps are a pixel wide, deviate more."""


def edges(kirchhoff: dict[str, Comparison], default: dict[str, Comparison]) -> str:
    """Lamellar and blazed gratings."""
    parts = [
        """## Edges

Vertical walls reflect light too, of which the model knows nothing; metals suffer most. Deviation of
colours, Kirchhoff / default. Blazed gratings ascend towards +x: at positive angles the light falls
on their steps, at negative ones along the facets."""
    ]
    for profile in ("lamellar", "blazed"):
        angles = angles_of(default["keratin"].where(profile=profile))
        rows = [
            [
                f"{material}, {grating.period:g}/{grating.depth:g} µm",
                *_side_by_side(kirchhoff[material], part, grating, angles),
            ]
            for material, part in default.items()
            for grating in gratings_of(part, profile)
        ]
        header = ["period/depth", *(f"{theta:g}°" for theta in angles)]
        parts.append(f"{sentence_case(profile)}:\n\n{table(header, rows)}")
    return "\n\n".join(parts)


def _side_by_side(
    first: Comparison, second: Comparison, grating: Grating, angles: Sequence[float]
) -> list[str]:
    """Deviations of colours by both, a cell for each angle."""
    both = (table_of(part, [grating], angles, _of_colours)[0] for part in (first, second))
    return [" / ".join(map(percent, pair)) for pair in zip(*both, strict=True)]


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
    return f"""## Polarisation of a perfect conductor

Without an index the model knows no polarisation, and stands for the mean. Held against one at a
time (TE: the electric field along the grooves) it is further off. Deviation of all orders:

{table(["grating", "light", *(f"{theta:g}°" for theta in angles)], rows)}"""


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
    return lambda part: part.deviation(light=name)


def _distances(z: NDArray[np.float64]) -> list[object]:
    return [len(z), f"{np.sqrt(np.mean(z**2)):.2f}", f"{np.abs(z).max():.1f}"]


def _pairs(values: Sequence[tuple[float, float]]) -> str:
    texts = [f"{period:g} and {depth:g}" for period, depth in values]
    return " or ".join(texts)
