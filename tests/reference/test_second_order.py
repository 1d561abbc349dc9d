"""Second order of the reference, against brute-force sums of the kernel M for small patches.

With B and B₂ the first two orders of perturbation, ĥ and a the spectra of the heights and of
exp(−iQh), Q = q + q0 and lengths over 2π/λ, the amplitude of an order to second order is

    B a + i/4 Σ_ξ M ĥ(ξ) a(k−k0−ξ),   M = B₂(k−ξ) + B₂(k0+ξ) + 2QB,

the sum over all waves in between, evanescent ones too (Voronovich 1994).
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from mitsuba_diffraction import HeightField, gratings, reference
from mitsuba_diffraction.optics.second_order import Perturbation
from mitsuba_diffraction.optics.slope_ratios import SLOPE_CUTOFF, Slopes
from mitsuba_diffraction.reference import model
from tests.support.directions import polar, rough_patch

PIT = np.zeros((16, 16))
PIT[5:10, 3:11] = -0.12
#: A smooth pit of 2.1 µm; RMS slope 0.1.
PITS = HeightField(gaussian_filter(PIT, 1.3, mode="wrap"), 0.13)


def in_plane_kernel(k0, k, u, index, p_polarised):
    """B along k, and B₂ along k by way of u, by expanding the reduced Rayleigh equation.

    Σ_k M⁺(p|k) R(k) = −M⁻(p|k0) for grooves across the plane of incidence (Toigo, Marvin, Celli
    and Hill 1977, Physical Review B 15, 5618), with M±(p|k) = N± I(γ)/γ, γ = α(p) ∓ q(k), I(γ) the
    spectrum of exp(−iγh), and N± = 1 of s and pk ± α(p)q(k) of p light.
    """

    def q(x):
        return np.sqrt(1 - x * x + 0j)

    def alpha(x):
        return np.sqrt(index**2 - x * x + 0j)

    def expanded(p, x, sign, power):
        gamma = alpha(p) - sign * q(x)
        numerator = p * x + sign * alpha(p) * q(x) if p_polarised else 1.0
        return numerator * (-1j * gamma) ** power / gamma / (2 if power == 2 else 1)

    def first(p):
        return -(expanded(p, k0, -1, 1) + expanded(p, k0, 1, 1) * flat) / expanded(p, p, 1, 0)

    flat = -expanded(k0, k0, -1, 0) / expanded(k0, k0, 1, 0)
    driven = expanded(k, k0, -1, 2) + expanded(k, k0, 1, 2) * flat
    second = -(driven + expanded(k, u, 1, 1) * first(u)) / expanded(k, k, 1, 0)
    return first(k) / (-2j * q(k0)), second / q(k0)


@pytest.mark.parametrize("index", [1.5, 0.7, 1.3 + 4j])
@pytest.mark.parametrize("k", [0.3, -0.4, 0.9])
def test_the_kernel_is_that_of_the_reduced_rayleigh_equation(k, index):
    k0, u = np.sin(np.radians(50)), np.array([0.2, -0.7, 1.3, -2.0])
    light = Perturbation([-k0, 0.0, np.sqrt(1 - k0**2)], index)
    first = light.first(np.array([k, 0.0]))
    second = light.second(np.array([[k, 0.0]]), np.stack([u, 0 * u], axis=1))
    for n, p_polarised in enumerate((False, True)):
        b, b2 = in_plane_kernel(k0, k, u, index, p_polarised)
        sign = np.sign(k)  # both axes turn with the direction of k; the equation's field does not
        assert first[n, n] == pytest.approx(sign * b, rel=1e-10)
        assert second[:, n, n] == pytest.approx(sign * b2, rel=1e-10)


def sums_of_the_kernel(field, wi, orders, wavelength, index):
    """Power of each order (n, 2) of unpolarised light over that of its first order."""
    wave = 2e3 * np.pi / wavelength
    heights, step = field.heights * wave, 2 * np.pi / (np.array(field.extent) * wave)
    ny, nx = heights.shape
    every = np.stack(np.meshgrid(np.arange(1 - nx // 2, nx // 2), np.arange(1 - ny // 2, ny // 2)))
    every = every.reshape(2, -1).T

    def at(function, order):
        return (np.fft.fft2(function) / function.size)[order[..., 1] % ny, order[..., 0] % nx]

    light, k0, factors = Perturbation(wi, index), -wi[:2], []
    for order in orders:
        k, xi = k0 + order * step, every * step
        kappa = np.sqrt(1 - k @ k) + wi[2]
        screen, first = np.exp(-1j * kappa * heights), light.first(k)
        kernel = light.second(k[None], k - xi) + light.second(k[None], k0 + xi) + 2 * kappa * first
        pairs = at(heights, every) * at(screen, order - every)
        second = 0.25j * np.tensordot(pairs, kernel, axes=1)
        once = first * at(screen, order)
        factors.append(np.sum(np.abs(once + second) ** 2) / np.sum(np.abs(once) ** 2))
    return np.array(factors)


@pytest.mark.parametrize("sign", [1, -1])
def test_in_oblique_light_most_of_the_brute_force_sums_is_found(sign):
    # pits and hills change colours by 8 and 10 %, in opposite directions
    field, wavelength, wi = HeightField(sign * PITS.heights, 0.13), 550.0, polar(60, 17)
    orders = np.stack(np.meshgrid(np.arange(-8, 9), np.arange(-8, 9)), axis=-1).reshape(-1, 2)
    tangential = orders * wavelength * 1e-3 / np.array(field.extent) - wi[:2]
    leaves = (np.hypot(*tangential.T) < 0.99) & np.any(orders != 0, axis=1)
    normal = np.sqrt(1 - np.sum(tangential[leaves] ** 2, axis=1))
    wo = np.concatenate([tangential[leaves], normal[:, None]], axis=1)
    first, both = (
        reference.brdf(field, wi, wo, wavelength, coherence_width=40.0, eta=1.5, second_order=told)
        for told in (False, True)
    )
    exact = sums_of_the_kernel(field, wi, orders[leaves], wavelength, 1.5)
    power = first * normal
    change = np.sum(power * np.abs(exact - 1.0)) / np.sum(power)
    error = np.sum(power * np.abs(exact - both / first)) / np.sum(power)
    assert change > 0.05
    # two complex numbers stand for the whole kernel; they take half of the change and more
    assert error < 0.6 * change


def test_the_factors_are_those_of_explicit_sums_over_pixels():
    field, kappa, sigma, s = rough_patch((13, 15), (0.13, 0.15), 0.3), 9.0, 0.45, 0.8
    c = np.array([0.3 - 0.2j, -0.1 + 0.4j])
    slopes = Slopes.from_heights(field.heights, field.pixel_size)
    screen = np.exp(1j * kappa * field.heights)
    orders = model.orders_near((3.0, -2.0), sigma, screen, field.pixel_size)
    found = model.second_order_factors(orders, screen, slopes, c, s)
    ny, nx = field.shape
    x, y = np.meshgrid(np.arange(nx) * field.pixel_size[0], np.arange(ny) * field.pixel_size[1])
    gradient = filtered_gradient(field)
    for n, qy in enumerate(orders.qy):
        for m, qx in enumerate(orders.qx):
            wave = np.exp(-1j * (kappa * field.heights + qx * x + qy * y))
            length = np.hypot(qx, qy)
            if length == 0.0:
                assert found[n, m] == 1.0
                continue
            lengthwise = (qx * gradient[0] + qy * gradient[1]) / length
            across = (qx * gradient[1] - qy * gradient[0]) / length
            r = [np.mean(part**2 * wave) / np.mean(wave) for part in (lengthwise, across)]
            added = s * slopes.gate * (c @ r)
            expected = np.abs(1 + added / max(1.0, 2 * abs(added))) ** 2
            assert found[n, m] == pytest.approx(expected, rel=1e-9)


def filtered_gradient(field):
    """∂h/∂x and ∂h/∂y of the surface filtered by 1/(1 + (q/23)²); odd numbers of pixels."""
    ny, nx = field.shape
    spectrum = np.fft.fft2(field.heights)
    qx = 2 * np.pi * np.fft.fftfreq(nx, field.pixel_size[0])
    qy = 2 * np.pi * np.fft.fftfreq(ny, field.pixel_size[1])
    spectrum /= 1 + (qx**2 + qy[:, None] ** 2) / SLOPE_CUTOFF**2
    return [np.fft.ifft2(1j * q * spectrum).real for q in (qx[None], qy[:, None])]


def test_auto_follows_the_change_of_colours():
    wi, wo = polar(60, 10), polar(25, 160)
    skin = gratings.sinusoidal(2.5, 0.1, periods=1, pixels_per_period=24, rows=2)
    grooves = gratings.lamellar(1.6, 0.125, duty=0.6875, periods=1, pixels_per_period=24, rows=2)
    for field, applied in ((skin, False), (grooves, True)):
        auto, told = (
            reference.brdf(field, wi, wo, 550.0, coherence_width=4.0, eta=1.5, second_order=second)
            for second in ("auto", applied)
        )
        assert np.array_equal(auto, told)
        assert np.array_equal(
            auto, reference.brdf(field, wi, wo, 550.0, coherence_width=4.0, eta=1.5)
        )
