"""The patch repeated: the transform of a rectangle of patches, written out."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.optics.geometry import sigma_of
from mitsuba_diffraction.thesis import methods
from mitsuba_diffraction.thesis.methods import Gain
from mitsuba_diffraction.thesis.methods.periodic import copies
from tests.directions import lit_pairs, polar


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


def test_pq_agrees_at_the_orders_with_either_interpolation(grating):
    of = methods.make_all(("pq", "pq-sinc"), grating, repeats=(4, 2))
    wi = polar(0.0)
    orders = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    wo = np.array([polar(np.degrees(np.arcsin(m * 0.6 / 2.0))) for m in orders])
    values = [of[name].relative(wi, wo, 600.0) for name in ("pq", "pq-sinc")]
    np.testing.assert_allclose(values[0], values[1], rtol=1e-6)
    # J_m²(κ·depth/2), sinusoidal grating
    from scipy.special import jv

    gain = Gain().factor(np.broadcast_to(wi, wo.shape), wo)
    kappa = 2 * np.pi / 0.6 * (1.0 + wo[:, 2])
    # the table's tolerance
    np.testing.assert_allclose(values[1] / gain, jv(orders, kappa * 0.06) ** 2, atol=1e-4)
