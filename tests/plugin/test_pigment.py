"""Pigment beneath a structure, and every named material as a surface."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.materials import METALS, TISSUES
from mitsuba_diffraction.plugin.conductors import tabulated_range
from mitsuba_diffraction.plugin.pigment import pigment_bsdf, pigment_range
from tests.support.variants import obstacle

FLAT = md.HeightField(np.zeros((8, 8)), 1.0, periodic=True)
SPECTRUM = "llvm_ad_spectral"


def test_plain_names_are_tabulated_conductors(some_variant):
    assert all(tabulated_range(symbol) for symbol in METALS.values())


@pytest.fixture
def spectral():
    if reason := obstacle(SPECTRUM):
        pytest.skip(reason)
    mi.set_variant(SPECTRUM)


@pytest.mark.parametrize("name", TISSUES)
def test_a_flat_tissue_reflects_by_its_index(spectral, name):
    lam = [400.0, 550.0, 700.0]
    surface = mi.load_dict(md.bsdf_dict(FLAT, material=name, coherence_width=20.0))
    found = md.spectrum(surface, 0.0, [0.0], acceptance=20.0, relative="none", wavelengths=lam)
    n = TISSUES[name].index(lam)
    # single precision, and the lobe is within 1e-3 of the cone
    assert found.value[:, 0] == pytest.approx(np.abs((n - 1) / (n + 1)) ** 2, rel=4e-3)


def test_pigment_under_keratin_reflects_its_spectrum(spectral, tmp_path):
    file = tmp_path / "brown.csv"
    file.write_text("wl,brown\n300,10\n500,10\n600,40\n800,40\n")
    assert pigment_range(str(file)) == (300.0, 800.0)
    bare, pigmented = (
        mi.load_dict(md.bsdf_dict(FLAT, material="keratin", **pigment))
        for pigment in ({}, {"pigment": str(file)})
    )
    lam = [450.0, 700.0]
    away = [md.spectrum(b, 10.0, [-40.0], wavelengths=lam).value[:, 0] for b in (bare, pigmented)]
    n = TISSUES["keratin"].index(lam).real
    through = [_transmitted(angle, n) for angle in (10.0, 40.0)]
    expected = np.array([0.1, 0.4]) * through[0] * through[1]
    # T of the flat interface is a quotient of tables in half precision
    assert away[1] - away[0] == pytest.approx(expected, rel=2e-3)


def _transmitted(angle, n):
    c = np.cos(np.radians(angle))
    inside = np.sqrt(1.0 - (np.sin(np.radians(angle)) / n) ** 2)
    s, p = (c - n * inside) / (c + n * inside), (n * c - inside) / (n * c + inside)
    return 1.0 - 0.5 * (s**2 + p**2)


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("wl,r\n500,0.1\n600,0.2\n", "500 to 600 nm"),
        ("nothing\n", "is not a spectrum"),
        ("400,0.1\n400,0.2\n", "is not a spectrum"),
        ("300,-5\n800,3\n", "-5 to 3"),
        ("300,1\n400,word\n800,3\n", "400,word"),
        ("300,500\n800,3\n", "3 to 500"),
    ],
)
def test_spectra_that_are_none_are_one_line(some_variant, tmp_path, content, named):
    file = tmp_path / "wrong.csv"
    file.write_text(content)
    with pytest.raises(md.DiffractionError, match=named) as caught:
        pigment_bsdf(str(file))
    assert "\n" not in str(caught.value)


def test_colours_are_greys_numbers_and_names(some_variant):
    assert "0.25" in str(pigment_bsdf(0.25))
    for text in ("0.3,0.2,0.1", "#804020", "sienna"):
        assert pigment_bsdf(text) is not None


def test_a_picture_is_a_pigment_by_texture_coordinates(spectral, tmp_path):
    file = tmp_path / "skin.png"
    mi.util.write_bitmap(
        str(file), mi.Bitmap(np.full((4, 4, 3), 0.5, np.float32)), write_async=False
    )
    assert "BitmapTexture" in str(pigment_bsdf(str(file)))
    with pytest.raises(md.DiffractionError, match="does not exist"):
        pigment_bsdf(str(tmp_path / "missing.png"))
