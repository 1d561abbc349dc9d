"""Exported materials in Cycles: energy, directions and colours. Needs Blender, skips without."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import RGB_WAVELENGTHS
from mitsuba_diffraction.orders import Band, CellResponse, OrderTable
from mitsuba_diffraction.osl.spectrum import NODES, drawn_spectrum
from tests.support.blender import blender
from tests.support.cycles import plane_seen

pytestmark = pytest.mark.thorough

PERIOD = 1.6


@pytest.fixture(autouse=True)
def _blender(some_variant):
    blender()


def table_of(values, superstrate=1.0):
    """Table whose efficiencies, of one node a band, are values(channels), (j, q)."""

    def kind(count):
        return np.repeat(values(count)[None, None, None, ..., None], 2, -1).astype(np.float32)

    last = OrderTable.mirror(PERIOD, superstrate=superstrate).last_band
    bands = tuple(Band(k, kind(k + 1), kind(k) if k else None) for k in range(last + 1))
    response = CellResponse(bands)
    return OrderTable((PERIOD, np.inf), (380.0, 780.0), response, superstrate)


def exported(table, folder, **parameters):
    return md.osl.export(mi.load_dict(md.bsdf_dict(table, **parameters)), folder)


def test_white_mirror_under_a_layer_is_white(tmp_path):
    mirror = OrderTable.mirror(PERIOD, superstrate=1.5)
    seen = plane_seen(exported(mirror, tmp_path), [0, 60])
    assert seen.mean == pytest.approx(1.0, abs=0.02)


def test_lossless_grating_is_white(tmp_path):
    """Light in equal parts in all orders, also where the lobes are wide."""
    equal = table_of(lambda n: np.full((n, n), 1.0 / n))
    seen = plane_seen(exported(equal, tmp_path), [20, 50], samples=1000)
    assert np.all(np.abs(seen.mean - 1.0) < 4.0 * seen.error + 5e-3), seen.mean
    assert seen.error.max() < 6e-3


def test_order_follows_the_grating_equation(tmp_path):
    """Light of order 1 alone, of grooves turned by 30°: the mean of its direction's component
    across the grooves is that of λ/d − sinθ cos 30°, by channel.

    Efficiency 1 wherever order 1 propagates; at 40° it does, in all of the visible.
    """
    one = table_of(lambda n: np.eye(n, k=-1) if n > 1 else np.zeros((1, 1)))
    theta, cos, sin = 40.0, np.cos(np.pi / 6), np.sin(np.pi / 6)
    seen = plane_seen(
        exported(one, tmp_path, orientation=30), [theta], sky=(cos, sin, 0.0, 1.0, 1),
        WorkingSpace="ACEScg",
    )  # fmt: skip
    spectrum = drawn_spectrum()
    u = (np.arange(4000) + 0.5) / 4000
    nodes = np.linspace(0.0, 1.0, NODES)
    colours = spectrum.colours["ACEScg"]
    weights = np.stack([np.interp(u, nodes, column) for column in colours.T])
    mean = (weights @ np.interp(u, nodes, spectrum.wavelengths)) / 4000
    expected = 1.0 + 1e-3 * mean / PERIOD - np.sin(np.radians(theta)) * cos
    # four standard errors, of some 0.001 of the light; a wavelength of 3 nm
    assert np.all(np.abs(seen.mean[0] - expected) < 4 * seen.error[0] + 1e-3)


@pytest.mark.parametrize("axis", [0, 1])
def test_lobe_is_as_wide_as_the_window_has_it(tmp_path, axis):
    """Second moments of a mirror's lobe: variance 1/(2σ²k²) of each direction cosine, at 50°."""
    width, theta = 12.0, 50.0
    centre = np.sin(np.radians(theta)) if axis == 0 else 0.0
    squared = (1.0 - axis, axis, 0.0, centre, 2)  # the mirror direction is at −x
    mirror = exported(OrderTable.mirror(PERIOD), tmp_path, coherence_width=width)
    seen = plane_seen(mirror, [theta], sky=squared, samples=256)
    variance = (1e-3 * np.array(RGB_WAVELENGTHS) / (0.5 * np.pi * width)) ** 2 / 2
    # mean of λ² over a channel is up to 1 % above the square of its mean; and noise
    assert seen.mean[0] == pytest.approx(variance, rel=0.04)
