"""The density of sampled directions, summed over each side, is the share of samples there."""

from __future__ import annotations

from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import as_single, polar, rough_patch

#: A random surface; its lobes are 0.04 rad wide, five cells of the grid below.
PATCH = rough_patch((66, 56), (0.085, 0.08), 0.08)
ROWS, COLUMNS, SAMPLES = 350, 700, 1 << 18


class Sides(NamedTuple):
    above: float
    below: float


def lit(theta: float, width: int) -> mi.SurfaceInteraction3f:
    si = dr.zeros(mi.SurfaceInteraction3f, width)
    si.wi = mi.Vector3f(*(dr.opaque(mi.Float, float(x)) for x in as_single(polar(theta, 20.0))))
    if mi.is_spectral:
        si.wavelengths = mi.UnpolarizedSpectrum(450.0, 520.0, 590.0, 660.0)
    return si


def summed(bsdf: mi.BSDF, theta: float) -> Sides:
    """∫ pdf dω above and below, by the midpoint rule in both angles."""
    n = dr.arange(mi.UInt32, ROWS * COLUMNS)
    row, column = mi.Float(n // COLUMNS), mi.Float(n % COLUMNS)
    sin, cos = dr.sincos((row + 0.5) * (dr.pi / ROWS))
    y, x = dr.sincos((column + 0.5) * (dr.two_pi / COLUMNS))
    density = bsdf.pdf(mi.BSDFContext(), lit(theta, len(n)), mi.Vector3f(sin * x, sin * y, cos))
    density *= sin * (dr.pi / ROWS * dr.two_pi / COLUMNS)
    return Sides(*(float(dr.sum(dr.select(s * cos > 0, density, 0.0))[0]) for s in (1, -1)))


def drawn(bsdf: mi.BSDF, theta: float) -> Sides:
    """Shares of the samples that have a direction above and below."""
    rng = mi.PCG32(SAMPLES)
    one, two = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    sample, _ = bsdf.sample(mi.BSDFContext(), lit(theta, SAMPLES), one, two)
    z = np.where(np.array(sample.pdf) > 0, np.array(sample.wo.z), 0.0)
    return Sides(float(np.mean(z > 0)), float(np.mean(z < 0)))


@pytest.mark.parametrize("kind", [{}, {"thin": True}], ids=["dielectric", "sheet"])
def test_the_density_sums_to_the_share_of_samples_on_each_side(some_variant, kind):
    bsdf = mi.load_dict(
        md.bsdf_dict(
            PATCH, plugin="diffraction_dielectric", coherence_width=4.5, int_ior=1.5,
            energy_conserving=False, **kind,
        )
    )  # fmt: skip
    for theta in (40.0, 80.0, 120.0):
        # 3.5 standard errors of the shares, at most 0.5 / √SAMPLES each
        assert summed(bsdf, theta) == pytest.approx(drawn(bsdf, theta), abs=3.5 * 0.5 / 512)
