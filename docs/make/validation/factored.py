"""What `second_order=true` brings, beside rigorous solutions: the second order as a factor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.optics import blend, boundary
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.optics.mean_second_order import coherent
from mitsuba_diffraction.optics.second_order import SlopeRatios, factor, interpolated
from mitsuba_diffraction.settings import TableSettings
from mitsuba_diffraction.tables.build.slope_ratios import slope_ratios

from .markdown import table
from .patch_sections import is_here
from .patch_solutions import Solved, solved
from .patches import KINDS, cell, patch_index, whole_patch
from .rayleigh import Real
from .second_order import GROUPS, Case, at, rows_of, scored

#: The default model, with r of each order, with r of the patch that a cut is from, with the mean of
#: either direction.
MODELS = ("default", "its own orders", "the whole patch", "either direction's mean")
#: Not blended with Kirchhoff's, as it is and with that mean.
ALONE = ("small slope alone", "small slope alone and the mean")
_GRATINGS = ("sinusoid", "crossed")


def section(*, quick: bool = False) -> str:
    """The table; ten seconds, `quick` for tests."""
    lit = MODELS[:3:2]
    cases = list(factored_cases(KINDS[3:4] if quick else KINDS))
    rows = rows_of(cases, MODELS, lit)
    header = ["surface", "cases", *MODELS, *(f"light, {name}" for name in lit)]
    return f"""## What second_order=true brings

The sum over all waves in between in closed form, as a factor on each order's power
([theory.md](theory.md#the-material)): two numbers that know directions and index alone, and two
ratios of spectra that know the heights alone. *Its own orders* has the ratios of each order, as
tables of short periods do; *the whole patch* those of the 20 to 65 µm that a cut is from, in cells
of many orders, as tables of scans do. Deviation of colours of keratin, mean and worst of the cases,
of the default model, blend included, without and with the factor; and all reflected light over the
rigorous. *Either direction's mean* is what films have by default, exp(s m) of both directions
(`mitsuba_diffraction/optics/mean_second_order.py`), on the bare surface.

{table(header, rows)}

In oblique light it takes most of the error on a CD, whose pits are all of one kind. On scales it
takes a quarter if each order has its own ratios, and a tenth from a whole patch: one window's
speckle has ratios of its own, which cells of many orders have not. What is left beyond the second
order's own error, above, is in waves in between that fade, which the closed form leaves out. At
normal incidence there is nothing to gain. It is for unpolarised light, and not for metals, where
surface plasmons are a pole that no such form has.

The mean of either direction is no way to the second order without a film: it leaves the cuts of
scales as they are. {_worst(cases)} What
the whole mean brings, in the table above, is in how both directions go together, a function of both
for each wavelength."""


def _worst(cases: Sequence[Case]) -> str:
    """Of the cuts of scales that deviate most by each model."""
    group = "cuts of scales, slope 0.2"
    found = {
        model: max((100.0 * c.deviation[model] for c in cases if c.group == group), default=0.0)
        for model in (*MODELS, *ALONE)
    }
    of = [f"{found[model]:.1f} %" for model in (MODELS[0], MODELS[3], MODELS[2], *ALONE)]
    return f"""The worst cut of slope 0.2 is {of[0]} off by
default, {of[1]} with that mean, {of[2]} with `second_order=true`; small slope alone, the end of any
blend, has {of[3]}, and {of[4]} with the mean: no one share of Kirchhoff's brings it within 10 %."""


def factored_cases(kinds: Sequence[str] = KINDS, models: Sequence[str] = MODELS) -> Iterator[Case]:
    """The kept solutions of keratin cells of these kinds, all of them and by incidence.

    models : those of `MODELS` that are slow to sum are left out if they are not among them.
    """
    for one in solved("keratin")[0]:
        surface = one.case.surface
        if surface.kind in kinds and is_here(one.case):
            group = f"{GROUPS[surface.kind]}, slope {surface.slope:.2g}"
            found = _case(group, one, models)
            yield found
            if surface.kind not in _GRATINGS:
                yield replace(found, group=f"{group}, from {one.case.theta:g}°")


def _case(group: str, one: Solved, models: Sequence[str]) -> Case:
    surface, wavelength = one.case.surface, one.case.wavelength
    field, index = cell(surface), patch_index("keratin", wavelength).real
    orders = np.stack([one.rows["mx"], one.rows["my"]], axis=1).astype(np.int64)
    wi, wo, wave = one.wi, one.wo(field), float(wavenumber(wavelength))
    kappa, q = wave * (wi + wo)[:, 2], wave * (wi + wo)[:, :2]
    roughness = blend.ScaleRoughness.of(field.heights, field.pixel_size)
    share = blend.weight(kappa, roughness.at(np.hypot(*q.T)), index)
    screens = [np.exp(-1j * k * field.heights) for k in kappa]
    amplitudes = np.array([at(*both) for both in zip(screens, orders, strict=True)])
    first = 4.0 * wi[2] * wo[:, 2] * (wave / kappa) ** 2 * np.abs(amplitudes) ** 2
    gentle = first * boundary.unpolarised(blend.jones(wi, wo, index, np.ones_like(share)))
    first = first * boundary.unpolarised(blend.jones(wi, wo, index, share))
    mean = _of_mean(roughness, index, wi, wo, wave)
    powers = {
        MODELS[0]: first,
        MODELS[3]: first * np.exp(share * mean),
        ALONE[0]: gentle,
        ALONE[1]: gentle * np.exp(mean),
    }
    for name in set(models).intersection(MODELS[1:3]):
        alone = name == MODELS[1] or surface.kind in _GRATINGS
        ratios = _ratios(field if alone else whole_patch(surface)).at(q, kappa)
        ratios[~orders.any(axis=1)] = 0.0  # order 0 is the first order's
        powers[name] = first * factor(interpolated(index, wi, wo), ratios, share)
    return scored(group, powers, one.efficiency(field), wo, orders)


def _of_mean(roughness: blend.ScaleRoughness, index: float, wi: Real, wo: Real, k: float) -> Real:
    """m of both directions."""
    nodes = np.linspace(0.0, np.radians(89.5), 60)
    m = coherent(np.cos(nodes), index, roughness, k)
    return np.asarray(sum(np.interp(np.arccos(w[..., 2]), nodes, m) for w in (wi, wo)))


@cache
def _ratios(patch: HeightField) -> SlopeRatios:
    return slope_ratios([patch], TableSettings(second_order=True, height_scale_max=1.0))
