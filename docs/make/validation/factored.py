"""What the default's second order, a factor on orders' powers, brings beside rigorous solutions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from mitsuba_diffraction.optics import blend
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.optics.mean_second_order import coherent

from .goals import Case as Angle
from .goals import Sides, models_of, singles
from .markdown import percent, table
from .model import DEFAULT, efficiencies, second_order, share_of
from .models import ANGLES, banded, of_te, of_tm
from .patch_solutions import Solved, solved
from .patches import GRATINGS, KINDS, cell, patch_index, ratios_of
from .rayleigh import Real
from .second_order import GROUPS, Case, rows_of, scored

#: The default without it, with r of each order, as it is, and with the mean of either direction.
MODELS = ("first order", "its own orders", "default", "either direction's mean")
#: Not blended with Kirchhoff's, in the first order and with that mean.
ALONE = ("small slope alone", "small slope alone and the mean")


def section(sides: Sides, *, quick: bool = False) -> str:
    """The tables; ten seconds, `quick` for tests.

    sides : a comparison for each (material, model).
    """
    lit = MODELS[:3:2]
    cases = list(factored_cases(KINDS[3:4] if quick else KINDS))
    rows = rows_of(cases, MODELS, lit)
    header = ["surface", "cases", *MODELS, *(f"light, {name}" for name in lit)]
    return f"""## What the second order brings

The sum over all waves in between in closed form, as a factor on each order's power
([theory.md](theory.md#the-material)): two numbers that know directions and index alone, and two
ratios of spectra that know the heights alone. The default has it on dielectrics; `second_order` of
a scene, false, leaves it out. Its ratios are those of each order on gratings, as tables of short
periods have them, and on cuts those of the 20 to 65 µm that a cut is from, in cells of many orders,
as tables of scans have them; *its own orders* has the cut's own. Deviation of colours of keratin,
mean and worst of the cases, without and with the factor, blend included; and all reflected light
over the rigorous. *Either direction's mean* is what films have by default, exp(s m) of both
directions (`mitsuba_diffraction/optics/mean_second_order.py`), on the bare surface.

{table(header, rows)}

In oblique light it takes most of the error on a CD, whose pits are all of one kind. On scales it
takes a quarter if each order has its own ratios, and a tenth from a whole patch: one window's
speckle has ratios of its own, which cells of many orders have not. What is left beyond the second
order's own error, above, is in waves in between that fade, which the closed form leaves out. At
normal incidence there is nothing to gain, and there the coefficients are faded out: without that,
four sinusoids were worse than by Kirchhoff. It is not for metals, where surface plasmons are a pole
that no such form has.

The mean of either direction is no way to the second order without a film: it leaves the cuts of
scales as they are. {_worst(cases)} What
the whole mean brings, in the table above, is in how both directions go together, a function of both
for each wavelength.

{_gratings(sides)}"""


def _gratings(sides: Sides) -> str:
    """Without and with it, by profile and depth over period, and where it harms."""
    models = models_of(sides, "keratin")
    parts = []
    for name in ("first_order", DEFAULT):
        one = models[name]
        lights = (banded(one, [60.0], measure) for measure in (of_te, of_tm))
        parts.append([
            (f"keratin, {profile}", f"{low:g} to {high:g}", [*values, *te[2], *tm[2]])
            for (profile, (low, high), values), te, tm in zip(banded(one), *lights, strict=True)
        ])  # fmt: skip
    rows = [
        [
            *first[:2],
            *(" / ".join(map(percent, pair)) for pair in zip(first[2], with_it[2], strict=True)),
        ]
        for first, with_it in zip(*parts, strict=True)
    ]
    header = ["grating", "depth/period", *(f"{a:g}°" for a in ANGLES), "TE 60°", "TM 60°"]
    every = singles(models)
    worse = sorted((c for c in every if _harm(c) > max(c.change, 0.001)), key=_harm, reverse=True)
    harmed = [
        [c.label, f"{c.theta:g}°".replace("-", "−"),
         *(percent(c.deviation(m)) for m in ("kirchhoff", "first_order", DEFAULT))]
        for c in worse
    ]  # fmt: skip
    return f"""Gratings, deviation of colours without / with it:

{table(header, rows)}

Lamellar and blazed gratings have walls, whose squared slopes say nothing: a gate shuts it off. Of
{len(every)} gratings and angles {len(worse)} are worse with it by more than the solver's last
refinement changed and a tenth of a point:

{table(["", "light from", "Kirchhoff", "first order", "default"], harmed)}

An order of a sinusoid has but two waves in between, and the closed form is the best for all of a
plane that travel: it misses those two. Their sum itself leaves 0.26 % of small slope alone's 1.6 %
on the one of 2.5/0.1 µm at 60°, but most of that by waves that fade; the closed form makes it
1.9 %. On steep ones the second order itself is not enough."""


def _harm(case: Angle) -> float:
    return case.deviation(DEFAULT) - case.deviation("first_order")


def _worst(cases: Sequence[Case]) -> str:
    """Of the cuts of scales that deviate most by each model."""
    group = "cuts of scales, slope 0.2"
    found = {
        model: max((100.0 * c.deviation[model] for c in cases if c.group == group), default=0.0)
        for model in (*MODELS, *ALONE)
    }
    of = [f"{found[model]:.1f} %" for model in (MODELS[0], MODELS[3], MODELS[2], *ALONE)]
    return f"""The worst cut of slope 0.2 is {of[0]} off by
the first order, {of[1]} with that mean, {of[2]} by default; small slope alone, the end of any
blend, has {of[3]}, and {of[4]} with the mean: no one share of Kirchhoff's brings it as far."""


def factored_cases(kinds: Sequence[str] = KINDS, models: Sequence[str] = MODELS) -> Iterator[Case]:
    """The kept solutions of keratin cells of these kinds, all of them and by incidence.

    models : those of `MODELS` that are slow to sum are left out if they are not among them.
    """
    for one in solved("keratin")[0]:
        surface = one.case.surface
        if surface.kind in kinds:
            group = f"{GROUPS[surface.kind]}, slope {surface.slope:.2g}"
            found = _case(group, one, models)
            yield found
            if surface.kind not in GRATINGS:
                yield replace(found, group=f"{group}, from {one.case.theta:g}°")


def _case(group: str, one: Solved, models: Sequence[str]) -> Case:
    surface, wavelength = one.case.surface, one.case.wavelength
    field, index = cell(surface), patch_index("keratin", wavelength).real
    orders = np.stack([one.rows["mx"], one.rows["my"]], axis=1).astype(np.int64)
    wi, wo = one.wi, one.wo(field)
    light = field, index, wi, wo, wavelength
    first, gentle = (
        efficiencies(field, complex(index), *light[2:], model, sigma=max(field.extent))
        for model in ("first_order", "small_slope_alone")
    )
    roughness = blend.ScaleRoughness.of(field.heights, field.pixel_size)
    mean = _of_mean(roughness, index, wi, wo, float(wavenumber(wavelength)))
    powers = {
        MODELS[0]: first,
        MODELS[3]: first * np.exp(share_of(*light) * mean),
        ALONE[0]: gentle,
        ALONE[1]: gentle * np.exp(mean),
    }
    for name, ratios in ((MODELS[1], None), (MODELS[2], ratios_of(surface))):
        if name in models:
            powers[name] = first * second_order(*light, ratios)
    return scored(group, powers, one.efficiency(field), wo, orders)


def _of_mean(roughness: blend.ScaleRoughness, index: float, wi: Real, wo: Real, k: float) -> Real:
    """m of both directions."""
    nodes = np.linspace(0.0, np.radians(89.5), 60)
    m = coherent(np.cos(nodes), index, roughness, k)
    return np.asarray(sum(np.interp(np.arccos(w[..., 2]), nodes, m) for w in (wi, wo)))
