"""Methods that take a surface as periodic, and the period: against sums written out; refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.optics.colour import response
from mitsuba_diffraction.optics.geometry import sigma_of
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods import OrdersOnly, estimate_periods
from mitsuba_diffraction.thesis.methods.periodic import copies
from tests.support.directions import lit_pairs, polar

#: Coherence width, µm: narrower than the rough patch.
WIDTH = 12.0


@settings(max_examples=20)
@given(st.floats(0.5, 5.0), st.sampled_from(["x", "y"]))
def test_the_period_of_a_grating_is_found(length, axis):
    patch = gratings.blazed(length, 0.2, periods=6, axis=axis)
    x, y = estimate_periods(patch)
    found, other = (x, y) if axis == "x" else (y, x)
    assert found.length == pytest.approx(length, rel=1e-3)
    assert found.confidence == pytest.approx(1.0, abs=1e-6)
    assert not other.reliable


def test_a_snake_s_scale_has_a_period_across_its_fingers_only():
    x, y = estimate_periods(gratings.elaphe_like(32.0, 512))
    assert x.reliable
    assert 0.9 < x.length < 1.2  # what it is made with (gratings.scales), some 1 µm
    assert not y.reliable


def test_a_given_period_serves_instead(rough):
    method = methods.make("nmm", rough, coherence_width=WIDTH, period=1.5)
    assert 1.5 in method.periods


@pytest.fixture(scope="module")
def pairs_of_a_sweep():
    """Light from 40°, views along x, away from the mirror direction."""
    theta = np.concatenate([np.linspace(-33.0, 25.0, 30), np.linspace(-70.0, -50.0, 10)])
    return polar(40.0), np.array([polar(t) for t in theta])


def test_nmm_with_the_width_of_lobes_is_the_whole_spectrum(grating, pairs_of_a_sweep):
    wi, wo = pairs_of_a_sweep
    settings = {"coherence_width": 240.0, "step": 0.5}
    full = methods.make("flss", grating, **settings)
    few = OrdersOnly(full, (2.0, None), weights="lobe")
    away = ~few.white_pairs(np.broadcast_to(wi, wo.shape), wo)
    assert away.sum() > 30
    exact, found = full.xyz(wi, wo[away]), few.xyz(wi, wo[away])
    # lobes are about 1 % of a wavelength wide; the observer's curves bend within them
    assert np.abs(found - exact).sum() < 0.01 * exact.sum()


def test_nmm_is_white_around_the_mirror_direction(grating):
    method = methods.make("nmm", grating, coherence_width=60.0)
    xyz = method.xyz(polar(30.0), [polar(-30.0), polar(-30.2)])
    white = xyz / xyz[:, 1:2]
    # x, y = 0.3127, 0.3290: D65
    chromaticity = white[:, :2] / white.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(chromaticity, [[0.3127, 0.3290]] * 2, atol=2e-4)
    assert xyz[0, 1] == pytest.approx(method.brdf(polar(30.0), polar(-30.0), 555.0)[0], rel=1e-3)


def test_nmm_takes_every_wavelength_of_an_order_once(grating):
    method = methods.make("nmm", grating, coherence_width=60.0)
    wi, wo = polar(0.0)[None], polar(50.0)[None]
    path = 2000.0 * np.sin(np.radians(50.0))
    taken = [float(w[0]) for w, weight in method.samples(wi, wo) if weight[0] > 0]
    expected = [path / n for n in range(1, 20) if 380.0 <= path / n <= 780.0]
    np.testing.assert_allclose(taken, expected, rtol=1e-3)  # the period is an estimate


@given(st.floats(-50.0, 50.0), st.integers(1, 400))
def test_copies_are_the_geometric_sum(x, n):
    direct = np.abs(np.mean(np.exp(2j * np.pi * x * np.arange(n))))
    # the direct sum's phases lose 2π·50·400 of the last bit, 3e-11
    assert copies(np.array([x]), n)[0] == pytest.approx(direct, abs=1e-10)


def test_copies_are_all_in_phase_at_whole_numbers():
    x = np.array([0.0, 1.0, -7.0, 1e4, 1e-12, 3.0 - 1e-13])
    np.testing.assert_allclose(copies(x, 1000), 1.0, atol=1e-8)


def test_pq_is_the_fourier_transform_of_a_rectangle_of_patches(rough, of_rough):
    wi, wo, wavelength, _ = lit_pairs(rough, sigma_of(60.0), 60, seed=5)
    wavelength = np.maximum(wavelength, 380.0)
    (ny, nx), (lx, ly) = rough.shape, rough.extent
    expected = np.empty(len(wi))
    for n, (i, o, lam) in enumerate(zip(wi, wo, wavelength, strict=True)):
        k = 2e3 * np.pi / lam
        u, v, w = i + o
        # band-limited heights between the pixels, as the table has them: the DFT's own orders
        a = np.fft.ifft2(np.exp(1j * k * w * rough.heights))
        jx, jy = np.fft.fftfreq(nx) * nx, np.fft.fftfreq(ny) * ny
        x, y = k * u * lx / (2 * np.pi) - jx, k * v * ly / (2 * np.pi) - jy
        # the integral of exp(i q x) over 3 (and 2) patches about the middle of the first one
        turn = np.cos(np.pi * (jx + jy[:, None]))
        b = np.sum(a * turn * np.sinc(x) * np.sinc(y)[:, None])
        many = [
            np.abs(np.mean(np.exp(1j * k * c * length * np.arange(m))))
            for c, length, m in ((u, lx, 3), (v, ly, 2))
        ]
        s = np.abs(b * many[0] * many[1]) ** 2
        cos_i, cos_o = i[2], o[2]
        area = 6 * lx * ly
        expected[n] = (1 + i @ o) ** 2 * area * s / ((lam * 1e-3) ** 2 * w**2 * cos_i * cos_o)
    found = of_rough["pq-sinc"].brdf(wi, wo, wavelength)
    linear = of_rough["pq"].brdf(wi, wo, wavelength)
    # a sinc cut off after 4 bins to either side leaves about 1/(4π) of its neighbours' amplitudes
    assert np.abs(found - expected).sum() < 0.05 * expected.sum()
    assert np.abs(found - expected).sum() < np.abs(linear - expected).sum()


def test_the_rainbow_s_colour_is_the_integral_of_its_spectrum(grating):
    method = methods.make("rainbow", grating, coherence_width=60.0)
    wo = np.array([polar(t) for t in (20.0, 35.0, 50.0, 70.0)])
    wavelength = np.arange(380.0, 780.01, 0.05)
    expected = np.zeros((4, 3))
    for n, direction in enumerate(wo):
        f = method.brdf(polar(0.0), np.broadcast_to(direction, (wavelength.size, 3)), wavelength)
        expected[n] = (f[:, None] * response(wavelength)).sum(axis=0) * 0.05
    # the observer's curves bend within a line of some nm
    assert np.abs(method.xyz(polar(0.0), wo) - expected).sum() < 0.01 * expected.sum()


def test_many_orders_together_are_white():
    flat = HeightField(np.zeros((4, 4)), 0.1)
    method = methods.make("rainbow", flat, period=60.0, coherence_width=65.0)
    xyz = method.xyz(polar(0.0), polar(60.0))[0]
    # a Lambertian white: 1/π in every channel of D65; some 70 orders are a fine sum already
    np.testing.assert_allclose(xyz * np.pi, [0.9505, 1.0, 1.089], rtol=5e-3)
