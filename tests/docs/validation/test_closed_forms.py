"""The package's orders against closed forms, and the forms against each other."""

from __future__ import annotations

import numpy as np
import pytest

import mitsuba_diffraction as md
from docs.make.validation.cases import PROFILES, WAVELENGTHS, Grating, in_plane, order_sines
from docs.make.validation.closed_forms import ANGLES, deviations, order_power
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.optics.geometry import kirchhoff_factor, wavenumber
from mitsuba_diffraction.optics.mirror import horizon_correction
from tests.support.directions import as_single
from tests.support.lanes import brdf_values


@pytest.mark.parametrize(("period", "depth"), [(1.1, 0.4), (2.5, 0.1)])
@pytest.mark.parametrize("profile", PROFILES)
def test_orders_hold_within_1e_4_up_to_75_degrees(profile, period, depth):
    found = deviations(Grating(profile, period, depth), pixels=256)
    assert found.orders > 100
    # the goal; the sampling of lamellar gratings leaves 4/(3·256²) = 2e-5 of it, and the table's
    # tolerance 3e-5
    assert found.integral < 3e-5
    assert found.table < 6e-5


@pytest.mark.parametrize("profile", PROFILES)
def test_the_renderer_s_orders_hold_within_1e_4_up_to_75_degrees(variant, profile):
    import mitsuba as mi

    grating, sigma = Grating(profile, 2.5, 0.4), 2.5
    strip = grating.heights(256)
    # a window much wider than the patch is refused
    wide = md.HeightField(np.tile(strip.heights, (4, 1)), strip.pixel_size)
    bsdf = mi.load_dict(
        md.bsdf_dict(
            wide, material="none", energy_conserving=False,
            coherence_width=4 * sigma, tolerance=1e-4,
        )
    )  # fmt: skip
    wi, wo, wavelengths, orders = lobe_centres(grating)
    value = brdf_values(bsdf, wi, wo, wavelengths[:, None])
    scale = kirchhoff_factor(wi, wo, wavelengths, sigma) * 4 * np.pi**2 * sigma**4
    # so narrow a window's lobe of order 0 reaches beyond the horizon, eq. 10
    levels = (sigma * each[:, 2] ** 2 for each in (wi, wo))
    visible = horizon_correction(*levels, wavenumber(wavelengths))
    scale *= np.where(orders == 0, visible, 1.0)
    exact = order_power(grating, orders, wavenumber(wavelengths) * (wi + wo)[:, 2])
    assert len(orders) > 300
    assert np.abs(value / scale - exact).max() < 1e-4


def lobe_centres(grating: Grating) -> tuple[np.ndarray, ...]:
    """wi, wo (n, 3), wavelengths (n,) and orders (n,), all exact in single precision."""
    found = []
    for wavelength in WAVELENGTHS:
        for theta in ANGLES:
            orders, sines = order_sines(grating.period, wavelength, theta)
            keep = np.abs(sines) <= np.sin(np.radians(75.0)) + 1e-9
            outgoing = in_plane(sines[keep])
            incident = np.broadcast_to(in_plane(np.sin(np.radians(theta))), outgoing.shape)
            lam = np.full(len(outgoing), wavelength)
            found.append((as_single(incident), as_single(outgoing), lam, orders[keep]))
    wi, wo, wavelengths, orders = (np.concatenate(column) for column in zip(*found, strict=True))
    return wi, wo, wavelengths, orders


@pytest.mark.parametrize("profile", PROFILES)
def test_the_orders_of_the_closed_forms_carry_all_light(profile):
    orders = np.arange(-3000, 3001)
    for kappa in (0.5, 9.0, 28.0):
        total = order_power(Grating(profile, 2.0, 0.3), orders, kappa).sum()
        # what lies beyond order n falls as 1/n where there are edges: 2·4/(π²·3000)/2
        assert total == pytest.approx(1.0, abs=2e-4)


def test_a_wrong_grating_is_noticed():
    # one that descends instead: the check can fail
    field = gratings.blazed(2.5, 0.1, periods=1, pixels_per_period=256, rows=2)
    screen = np.exp(1j * 15.0 * field.heights[0])
    power = np.abs(np.fft.ifft(screen)) ** 2
    orders = np.arange(-3, 4)
    exact = order_power(Grating("blazed", 2.5, 0.1), orders, 15.0)
    assert np.abs(power[orders] - exact).max() > 0.01
    assert power[-orders] == pytest.approx(exact, abs=1e-4)
