"""Change of colours by the second order: measured on cells as order by order."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from mitsuba_diffraction import gratings
from mitsuba_diffraction.optics import blend
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.optics.second_order import factor, slope_coefficients
from mitsuba_diffraction.optics.second_order_change import applies, colour_change
from mitsuba_diffraction.optics.slope_ratios import CellGrid, CellSums, Slopes, along
from mitsuba_diffraction.reference import boundary
from tests.support.directions import polar

VISIBLE = (360.0, 830.0)
Q_LIMIT = 2.0 * float(wavenumber(VISIBLE[0]))


def measured(field) -> float:
    grid = CellGrid.for_patches(field.extent, field.rms_height, Q_LIMIT)
    sums = CellSums.of_patches([(field, np.ones((1, 1)))], grid)
    roughness = blend.ScaleRoughness.from_heights(field.heights, field.pixel_size)
    return colour_change(sums, sums.ratios(), roughness, VISIBLE)


def order_by_order(field) -> float:
    """Σ|ΔP| / Σ P of a period's orders, each at its own κ, with exact c, in light from 60°."""
    ny, nx = field.shape
    qx, qy = (
        2 * np.pi * np.fft.fftfreq(n, d) for n, d in zip((nx, ny), field.pixel_size, strict=True)
    )
    q = np.stack(np.meshgrid(qx, qy), axis=-1).reshape(-1, 2)
    slopes = Slopes.from_heights(field.heights, field.pixel_size)
    roughness = blend.ScaleRoughness.from_heights(field.heights, field.pixel_size)
    changed = total = 0.0
    for wave in wavenumber([454.0, 548.0, 642.0]):
        for azimuth in 360.0 * (np.arange(8) + 0.25) / 8:
            wi = polar(60.0, azimuth)
            tangential = q / wave - wi[:2]
            leaves = np.hypot(*tangential.T) < np.sin(np.radians(85.0))
            for n in np.flatnonzero(leaves & np.any(q != 0.0, axis=1)):
                wo = np.array([*tangential[n], np.sqrt(1.0 - np.sum(tangential[n] ** 2))])
                w = wi[2] + wo[2]
                screen = np.exp(-1j * wave * w * field.heights)
                functions = screen * np.array([np.ones(field.shape), *slopes.products])
                a, *products = np.fft.fft2(functions).reshape(4, -1)[:, n] / (nx * ny)
                if abs(a) < 1e-9:  # along the grooves there is no light
                    continue
                share = boundary.small_slope_weight(wave * w, roughness.at(np.hypot(*q[n])), 1.5)
                power = wo[2] * boundary.unpolarised(boundary.blended(wi, wo, 1.5, share)) / w**2
                power *= abs(a) ** 2
                r = slopes.gate * along(q[n], np.array(products)) / a
                c = slope_coefficients(wi, wo[None], 1.5)[0]
                total += power
                changed += power * abs(factor(c, r, share) - 1.0)
    return changed / total


@pytest.mark.parametrize(
    "field",
    [
        gratings.sinusoidal(2.5, 0.1, periods=1, pixels_per_period=16, rows=2),
        gratings.blazed(2.5, 0.25, periods=1, pixels_per_period=20, rows=2),
    ],
)
def test_the_change_is_that_of_a_sum_order_by_order(field):
    # c from a table of angles, powers and ratios linear between values of κ
    assert measured(field) == pytest.approx(order_by_order(field), rel=0.05)


def test_auto_takes_discs_and_gratings_but_not_skins():
    # precompute/*.toml at a fifth of the width; light from 60° on the whole patches: 3, 13, 24 %
    skin = measured(gratings.elaphe_like(extent=12.0, pixels=200, depth=0.375, seed=0))
    disc = measured(gratings.cd(extent=12.0, pixels=200, seed=0))
    grooves = measured(gratings.lamellar(1.6, 0.125, duty=0.6875, pixels_per_period=32, periods=1))
    assert 0.01 < skin < 0.05 < grooves < disc < 0.4


def test_a_flat_surface_has_no_change():
    assert measured(gratings.sinusoidal(2.5, 0.0, periods=1, rows=2)) == 0.0


def test_true_and_false_apply_whatever_the_change():
    field = gratings.sinusoidal(2.5, 0.1, periods=1, pixels_per_period=16, rows=2)
    grid = CellGrid.for_patches(field.extent, field.rms_height, Q_LIMIT)
    ratios = CellSums.of_patches([(field, np.ones((1, 1)))], grid).ratios()
    for change, auto in ((0.049, False), (0.05, True)):
        changed = dataclasses.replace(ratios, change=change)
        assert [applies(asked, changed) for asked in ("auto", True, False)] == [auto, True, False]
