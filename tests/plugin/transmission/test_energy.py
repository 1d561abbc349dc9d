"""Surfaces that let light through: they send on all light, and samples are as dense as `pdf`."""

from __future__ import annotations

from typing import NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from tests.support.directions import as_single, polar, rough_patch
from tests.support.furnace import furnace_in
from tests.support.transmitting import SIDES

pytestmark = [
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
    pytest.mark.usefixtures("some_variant"),
]

FIELDS = {
    "flat": md.HeightField(np.zeros((8, 8)), 8.0),
    "50 nm": rough_patch((48, 48), (0.1, 0.1), 0.05, 1.0),
    "5 nm": rough_patch((200, 200), (0.1, 0.1), 0.005, 1.0),
}
STEEP = md.HeightField(0.1 * np.random.default_rng(3).random((40, 40)), 0.1, periodic=True)
#: From above and from below.
DIRECTIONS = np.array([polar(theta, 20.0) * [1, 1, side] for theta in (0, 45) for side in (1, -1)])
SAMPLES = 1 << 12


def passed(field, kind, index, width, **more):
    """Mean weight of samples (4 wavelengths, directions), its error, and the largest weight."""
    parameters = {"int_ior": index, "ext_ior": 1.0, "coherence_width": width, **SIDES[kind], **more}
    bsdf = mi.load_dict(md.bsdf_dict(FIELDS[field], plugin="diffraction_dielectric", **parameters))
    count = len(DIRECTIONS)
    si = dr.zeros(mi.SurfaceInteraction3f, count * SAMPLES)
    si.wi = mi.Vector3f(np.repeat(DIRECTIONS, SAMPLES, axis=0).astype(np.float32).T)
    si.wavelengths = mi.Spectrum(410.0, 500.0, 590.0, 690.0)
    rng = mi.PCG32(count * SAMPLES)
    sample1, sample2 = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    context = mi.BSDFContext(mi.TransportMode.Importance)
    weights = np.array(bsdf.sample(context, si, sample1, sample2)[1], float)
    weights = weights.reshape(-1, count, SAMPLES)
    return weights.mean(axis=2), weights.std(axis=2) / np.sqrt(SAMPLES), weights.max()


@pytest.mark.parametrize("kind", SIDES)
@pytest.mark.parametrize(
    ("field", "index", "width"),
    [("5 nm", 1.2, 65.0), ("flat", 1.06, 10.0)],
)
def test_no_light_comes_from_nothing(field, kind, index, width):
    mean, error, most = passed(field, kind, index, width)
    # the table's tolerance, and what 4 standard errors of 64 trials leave
    assert np.all(np.abs(mean - 1.0) < 4.0 * error + 5e-3)
    assert most < 20.0  # one of ten samples or more is drawn from each side


def test_a_narrow_window_at_a_critical_angle_gains_nothing():
    """An index of 1.0145, from inside beyond 80.3°: its rounding moves the critical angle."""
    mi.set_variant("llvm_ad_mono")
    given = {"int_ior": 1.0145, "ext_ior": 1.0, "coherence_width": 2.0}
    flat = md.HeightField(np.zeros((8, 8)), 0.5)
    bsdf = mi.load_dict(md.bsdf_dict(flat, plugin="diffraction_dielectric", **given))
    angles = np.array([60.0, 82.0, 84.0, 87.0, 88.3, 89.5])
    directions = np.array([polar(theta, 20.0) * [1, 1, -1] for theta in angles])
    mean, error = furnace_in(bsdf, directions, 1)
    assert np.all(mean <= 1.005 + 4.0 * error), mean


@pytest.mark.parametrize("kind", SIDES)
def test_colours_of_what_goes_through_gain_nothing(kind):
    """A channel's scale is that of its light as it is weighted: red has negative weights."""
    mi.set_variant("llvm_ad_rgb")
    given = {"int_ior": 2.4, "ext_ior": 1.0, "coherence_width": 12.0, **SIDES[kind]}
    bsdf = mi.load_dict(md.bsdf_dict(STEEP, plugin="diffraction_dielectric", **given))
    directions = np.array([polar(theta, 20.0) for theta in (0.0, 20.0, 40.0, 60.0, 70.0)])
    mean, _ = furnace_in(bsdf, directions, 1)
    # of five means, each of an error of 0.004, in colours whose luminance is at most 1
    assert (np.array([0.2126, 0.7152, 0.0722]) @ mean).mean() < 1.004


@pytest.mark.parametrize("kind", SIDES)
def test_one_window_of_a_rough_surface_sends_on_all_light(kind):
    """Orders interfere with one another, and in reflected light with order 0."""
    mean, error, _ = passed("50 nm", kind, 1.3, 3.0, coherence="patch")
    # the density of speckle is linear between samples of κ and of directions
    assert np.all(np.abs(mean - 1.0) < 4.0 * error + 2e-2)


#: A random surface; its lobes are 0.04 rad wide, five cells of the grid below.
DENSE = rough_patch((66, 56), (0.085, 0.08), 0.08)
ROWS, COLUMNS, DRAWN = 350, 700, 1 << 18


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
    rng = mi.PCG32(DRAWN)
    one, two = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    sample, _ = bsdf.sample(mi.BSDFContext(), lit(theta, DRAWN), one, two)
    z = np.where(np.array(sample.pdf) > 0, np.array(sample.wo.z), 0.0)
    return Sides(float(np.mean(z > 0)), float(np.mean(z < 0)))


@pytest.mark.parametrize("kind", SIDES.values(), ids=SIDES)
def test_the_density_sums_to_the_share_of_samples_on_each_side(some_variant, kind):
    bsdf = mi.load_dict(
        md.bsdf_dict(
            DENSE, plugin="diffraction_dielectric", coherence_width=4.5, int_ior=1.5,
            energy_conserving=False, **kind,
        )
    )  # fmt: skip
    for theta in (40.0, 80.0, 120.0):
        # 3.5 standard errors of the shares, at most 0.5 / √DRAWN each
        assert summed(bsdf, theta) == pytest.approx(drawn(bsdf, theta), abs=3.5 * 0.5 / 512)
