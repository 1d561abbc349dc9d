"""Colour tables against the integral over wavelengths, done the slow and obvious way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, DiffractionWarning, HeightField
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.tables.colour import table as colour_table
from mitsuba_diffraction.tables.colour.table import ColourTable, cached_colours
from tests.support.directions import Array, rough_patch
from tests.support.patches import SPECKLE

WIDTH = 10.0  # µm: wide lobes, which small tables hold


def integral(table: DiffractionTable, u: Array, v: Array, z: Array) -> Array:
    """RGB (n, 3) from window sums at some hundred wavelengths."""
    lam = np.linspace(362.0, 790.0, 215)
    weights = linear_srgb(response(lam))
    weights /= weights.sum(axis=0)
    k = 2e3 * np.pi / lam
    power = table.window_sum(u[:, None] * k, v[:, None] * k, z[:, None] * k)
    return np.asarray((power / (lam * 1e-3) ** 2) @ weights)


def directions(n: int) -> tuple[Array, Array, Array]:
    """u, v and w of light from anywhere to anywhere, half of it near the mirror direction."""
    rng = np.random.default_rng(0)
    radius = np.where(np.arange(n) % 2, np.exp(rng.uniform(-6, 0, n)), rng.uniform(0, 1.8, n))
    angle = rng.uniform(0.0, 2 * np.pi, n)
    w = rng.uniform(0.1, 0.98, n) * np.sqrt(4.0 - radius**2)
    return radius * np.cos(angle), radius * np.sin(angle), w


CASES = {
    "small": (SPECKLE["heights"], SPECKLE),
    "rough": (rough_patch((40, 48), (0.2, 0.25), 0.4), {}),
    "taylor": (rough_patch((40, 48), (0.2, 0.25), 0.2), {"basis": "taylor"}),
    "patch": (rough_patch((40, 48), (0.2, 0.25), 0.4), {"coherence": "patch"}),
    "wider than its window": (rough_patch((100, 100), (0.2, 0.2), 0.3), {"coherence_width": 5.0}),
    # the window is many orders wide along x only
    "elongated": (rough_patch((6, 160), (0.2, 0.25), 0.3), {"coherence_width": 3.0}),
    "deep": (rough_patch((40, 48), (0.2, 0.25), 1.2, 1.2), {}),
}


QUICK = "small"


@pytest.mark.parametrize(
    "case", [QUICK, *(pytest.param(c, marks=pytest.mark.thorough) for c in CASES if c != QUICK)]
)
def test_colours_are_the_integral_over_wavelengths(case: str) -> None:
    heights, arguments = CASES[case]
    table = DiffractionTable.build(**{"heights": heights, "coherence_width": WIDTH, **arguments})
    cached_colours(table)
    colours = cached_colours(replace(table))  # of another table of the same content: from the disk
    u, v, w = directions(120)
    expected, found = integral(table, u, v, w), colours.colour(u, v, w)
    away = np.hypot(u, v) > 3.0 * colours.radius_end / 4.5
    # azimuths 0.75 lobes apart, interpolated linearly, cut peaks by up to 7 % and 2 % on average;
    # order 0, on a fine table of its own, is right to 2e-3
    for part, tolerance in ((away, 0.02), (~away, 2e-3)):
        error = np.abs(found - expected)[part].sum() / np.abs(expected)[part].sum()
        assert error < tolerance


@pytest.mark.thorough
def test_the_difference_of_tables_is_that_of_orders_which_a_picture_shows() -> None:
    """Directions beside the orders of clean grooves are a millionth as bright: 7.8 by those."""
    y, x = np.mgrid[:400, :400] * 0.05
    grooves = 0.05 * np.sin(2 * np.pi * (x * np.cos(0.43) + y * np.sin(0.43)) / 1.2)
    colours = cached_colours(DiffractionTable.build(HeightField(grooves, 0.05)))
    exact = colours.coefficients.astype(np.float32)
    step = 2.0**-17 * np.abs(exact).max()  # as in pages
    fewer = replace(colours, coefficients=(np.round(exact / step) * step).astype(np.float16))
    assert 0.0 < colour_table.colour_difference(colours, fewer).mean() < 0.1


def test_a_table_too_large_is_coarser_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(colour_table, "MAX_BYTES", 4_400_000)
    table = DiffractionTable.build(rough_patch((40, 48), (0.2, 0.25), 0.4), coherence_width=20.0)
    with pytest.warns(DiffractionWarning, match="blurred"):
        colours = ColourTable.build(table)
    assert colours.nbytes <= 4_400_000
