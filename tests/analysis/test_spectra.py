"""Spectra against closed forms, and against the reference integrated over the acceptance."""

from __future__ import annotations

import math

import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mitsuba_diffraction as md
from mitsuba_diffraction.analysis.spectra import mean_spectra
from mitsuba_diffraction.analysis.spectra_files import (
    colour_of,
    columns_of,
    errors_of,
    save_csv,
    spectra_figure,
)
from mitsuba_diffraction.analysis.spectrometer import STEEPEST, MeasurementGeometry
from tests.support.directions import Array, polar, rough_patch
from tests.support.variants import use

LAM = np.array([420.0, 500.0, 580.0, 660.0])
FLAT = md.HeightField(np.zeros((8, 8)), 1.0, periodic=True)


@pytest.fixture(
    scope="module", params=["llvm_ad_spectral", "llvm_ad_spectral_polarized"], autouse=True
)
def variant(request):
    return use(request.param)


def load(field, **parameters):
    return mi.load_dict(md.bsdf_dict(field, **parameters))


def fresnel(theta: float, n: float) -> tuple[float, float]:
    """s and p reflectance of a flat dielectric."""
    c, ct = math.cos(theta), math.sqrt(1.0 - (math.sin(theta) / n) ** 2)
    return ((c - n * ct) / (c + n * ct)) ** 2, ((ct - n * c) / (ct + n * c)) ** 2


def test_a_cone_wider_than_the_lobe_collects_what_a_flat_surface_reflects(variant):
    """A lobe of the window 20 µm wide is within 3 % of a cone of 20°; R is linear across it."""
    surface = load(FLAT, coherence_width=20.0, int_ior=1.5)
    s, p = fresnel(math.radians(45.0), 1.5)
    light = md.spectrum(surface, 45.0, [45.0, -30.0], acceptance=20.0, relative="none",
                        wavelengths=LAM)  # fmt: skip
    assert light.value[:, 0] == pytest.approx(0.5 * (s + p), rel=2e-3)
    assert light.value[:, 1] == pytest.approx(0.0, abs=1e-9)
    if light.s is None:
        assert "polarized" not in variant
    else:
        assert light.s[:, 0] == pytest.approx(s, rel=2e-3)
        assert light.p[:, 0] == pytest.approx(p, rel=2e-3)
    mirror = md.spectrum(surface, 45.0, [45.0], acceptance=0.5, relative="mirror", wavelengths=LAM)
    assert mirror.value == pytest.approx(0.5 * (s + p), rel=2e-3)


def test_a_white_surface_is_a_white_standard():
    white = mi.load_dict({"type": "diffuse", "reflectance": 1.0})
    found = md.spectrum(white, 30.0, [-50.0, 0.0, 80.0], acceptance=10.0, wavelengths=LAM)
    assert found.value == pytest.approx(1.0, rel=1e-5)


def test_means_have_standard_errors_and_files_have_columns(tmp_path):
    white, grey = (
        md.spectrum(mi.load_dict({"type": "diffuse", "reflectance": r}), wavelengths=LAM)
        for r in (1.0, 0.5)
    )
    mean = mean_spectra([white, grey])
    assert mean.value == pytest.approx(0.75, rel=1e-5)
    assert mean.error == pytest.approx(0.25, rel=1e-5)
    assert mean_spectra([white]) is white
    save_csv(tmp_path / "s.csv", mean.wavelength, columns_of({"": mean}))
    save_csv(tmp_path / "e.csv", mean.wavelength, errors_of({"": mean}))
    rows = np.genfromtxt(tmp_path / "s.csv", delimiter=",", names=True)
    assert rows.dtype.names[:2] == ("wl", "light30_detector30")
    assert rows["wl"] == pytest.approx(LAM)
    assert rows["light30_detector30"] == pytest.approx(75.0, rel=1e-4)
    errors = np.genfromtxt(tmp_path / "e.csv", delimiter=",", names=True)
    assert errors["light30_detector30"] == pytest.approx(25.0, rel=1e-4)
    red, green, blue = colour_of(mean)[0]
    assert np.ptp([red, green, blue]) < 0.2  # four wavelengths make almost a grey
    axes = spectra_figure({"": mean}, "a scan").axes[0]
    assert "nm" in axes.get_xlabel()
    assert "%" in axes.get_ylabel()


@settings(max_examples=40)
@given(
    st.floats(), st.lists(st.floats(), max_size=3), st.floats(), st.floats(),
)  # fmt: skip
def test_geometries_are_measurable_or_refused(light, detectors, azimuth, acceptance):
    try:
        geometry = MeasurementGeometry(light, tuple(detectors), azimuth, acceptance)
    except md.DiffractionError as error:
        assert "\n" not in str(error)
        return
    assert 0.0 <= geometry.light <= STEEPEST
    assert max(map(abs, geometry.detectors)) + 0.5 * geometry.acceptance <= STEEPEST


def test_a_wide_cone_collects_a_mirror_s_narrow_lobe_wherever_it_lies():
    """A lobe of a standard deviation of 0.17°, 20° from the axis of a cone of 120°."""
    surface = load(FLAT, coherence_width=65.0, int_ior=1.5)
    light = md.spectrum(surface, 0.0, [20.0], acceptance=120.0, relative="none",
                        wavelengths=[420.0])  # fmt: skip
    assert light.value[0] == pytest.approx(0.04, rel=2e-3)


def test_default_wavelengths_are_within_the_table():
    assert (md.spectrum(load(md.OrderTable.mirror(0.6))).value > 0.0).all()


ANGLES, LIGHT, AZIMUTH, ACCEPTANCE = (0.0, 35.0), 20.0, 30.0, 5.0


def _cone(angle: float, n: int = 400) -> Array:
    """Directions (n, 3) of equal solid angles around a detector's, by the golden angle."""
    half, phi = math.radians(ACCEPTANCE / 2), math.radians(AZIMUTH)
    alpha = np.arccos(1 - (np.arange(n) + 0.5) / n * (1 - math.cos(half)))[:, None]
    psi = np.pi * (3.0 - math.sqrt(5.0)) * np.arange(n)[:, None]
    axis, side = polar(-angle, AZIMUTH), np.array([-math.sin(phi), math.cos(phi), 0.0])
    up = np.cross(axis, side)
    return np.cos(alpha) * axis + np.sin(alpha) * (np.cos(psi) * side + np.sin(psi) * up)


def test_spectra_are_the_reference_s_over_the_acceptance():
    """Other materials and media: test_spectra_of_tissue.py."""
    patch, lam = rough_patch((24, 24), (0.15, 0.15), 0.08), LAM[::3]
    found = md.spectrum(
        load(patch, int_ior=1.5), LIGHT, ANGLES, light_azimuth=AZIMUTH, acceptance=ACCEPTANCE,
        wavelengths=lam,
    ).value  # fmt: skip
    expected = np.empty((len(lam), len(ANGLES)))
    for n, m in np.ndindex(expected.shape):
        wo = _cone(ANGLES[m])
        f = md.reference.brdf(patch, polar(LIGHT, AZIMUTH), wo, lam[n], eta=1.5)
        expected[n, m] = (f * wo[:, 2]).sum() / (wo[:, 2] / np.pi).sum()
    # 1 %: the table's tolerance, and 400 directions of the cone
    assert found == pytest.approx(expected, rel=0.01)
