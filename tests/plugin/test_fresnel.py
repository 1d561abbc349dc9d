"""The surface's own reflectance: in the model `kirchhoff` Fresnel's, once, at the half vector."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.optics.fresnel import Filmed, normal_reflectance
from mitsuba_diffraction.optics.geometry import sigma_of, wavenumber
from mitsuba_diffraction.optics.mirror import mirror_cosine
from mitsuba_diffraction.plugin.conductors import tabulated_index
from mitsuba_diffraction.reference.fresnel import reflectance
from tests.support.directions import as_single, polar, uniform_directions
from tests.support.lanes import evaluated, interaction, refusal, spectra

FLAT = md.HeightField(np.zeros((30, 30)), 0.08)
WIDTH = 2.4


def load(field=FLAT, **parameters):
    """A mirror with these parameters: the model as it is, which has R as a factor."""
    raw = {"model": "kirchhoff", "energy_conserving": False, "coherence_width": WIDTH}
    return mi.load_dict(md.bsdf_dict(field, **(raw | parameters)))


def ratios(wi, wo, wavelengths, width=WIDTH, **parameters):
    """How much less than with R = 1 is reflected, (n, 4)."""
    perfect, real = (
        evaluated(load(coherence_width=width, **p), wi, wo, wavelengths)
        for p in ({"material": "none"}, parameters)
    )
    return real / perfect


def mirror_cosines(wi, wo):
    """cosθ at which the lobe has its reflectance: of the half vector, but near the horizon."""
    half = wi + wo
    cosine = np.sum(wi * half, axis=-1) / np.linalg.norm(half, axis=-1)
    return mirror_cosine(cosine, wi[..., 2], wo[..., 2], wavenumber(550.0) * sigma_of(WIDTH))


@pytest.fixture
def pairs():
    """Direction pairs within reach of a mirror's lobe, at all angles."""
    rng = np.random.default_rng(2)
    wi = uniform_directions(60, rng, lowest=0.15)
    wo = wi * [-1, -1, 1] + rng.normal(0, 0.05, (60, 3))
    wo = as_single(wo / np.linalg.norm(wo, axis=1, keepdims=True))
    good = wo[:, 2] > 0.05
    return wi[good], wo[good]


@pytest.mark.parametrize(
    ("parameters", "eta"),
    [
        ({}, 1.5 / 1.000277),
        ({"int_ior": 1.0, "ext_ior": 1.0}, 1.0),
        ({"int_ior": 1.33}, 1.33 / 1.000277),
        ({"int_ior": 1.7, "ext_ior": 1.2}, 1.7 / 1.2),
        ({"int_ior": "diamond", "ext_ior": "vacuum"}, 2.419),
        ({"ext_ior": 1.0}, 1.5),
    ],
)
def test_dielectrics(some_variant, pairs, parameters, eta):
    expected = reflectance(mirror_cosines(*pairs), eta)
    # Fresnel's formulas in single precision
    found = ratios(*pairs, 550.0, **parameters)[:, 0]
    assert found == pytest.approx(expected, rel=1e-5, abs=1e-6 if eta == 1.0 else 0.0)


def test_a_conductor_by_its_name_is_mitsuba_s(variant):
    wavelengths = [400.0, 480.0, 560.0, 700.0]
    wi = [polar(t) for t in (0, 40, 75)]
    wo = [polar(t, 180) for t in (0, 40, 75)]
    # a wide window: a lobe far from the horizon
    ours = ratios(wi, wo, np.tile(wavelengths, (3, 1)), 65.0, material="Au")
    smooth = mi.load_dict({"type": "conductor", "material": "Au"})
    si = interaction(wi, np.tile(wavelengths, (3, 1)))
    _, theirs = smooth.sample(mi.BSDFContext(), si, 0.5, mi.Point2f(0.5))
    assert ours == pytest.approx(spectra(theirs), rel=1e-4)  # the half vector, in single precision
    assert ours[0, 0] < 0.5 < ours[0, 3]  # gold is yellow


@pytest.mark.parametrize(("material", "last"), [("MgO", 767.0), ("TiN", 826.0)])
@pytest.mark.parametrize("model", ["small_slope", "kirchhoff"])
def test_beyond_its_table_a_material_has_the_index_of_the_table_s_end(
    some_variant, model, material, last
):
    """Mitsuba's own conductors have the index 0 there: R = 1, and NaN in ours."""
    wi, wo = polar(40.0), polar(40.0, 180.0)
    wide = {"coherence_width": 65.0}  # a lobe far from the horizon
    bare, mirror = load(material=material, model=model, **wide), load(material="none", **wide)
    shares = [
        evaluated(bsdf, wi[None], wo[None], np.array([[360.5, 500.0, last, 829.5]]))[0]
        for bsdf in (bare, mirror)
    ]
    share = shares[0] / shares[1]
    assert share[3] == pytest.approx(share[2], rel=2e-3)  # nodes lie up to 0.7 nm further
    assert np.all((share > 0.01) & (share < 0.9))


def test_a_material_whose_table_ends_amid_the_spectrum_is_refused_in_one_line(some_variant):
    line = refusal(lambda: load(material="AlSb"))
    for word in ("AlSb", "302.4", "590.4", "eta and k"):
        assert word in line


@pytest.mark.parametrize("thickness", [20.0, 60.0, 400.0])
def test_colours_of_a_film_on_a_metal_are_those_of_its_spectrum(thickness):
    mi.set_variant("llvm_ad_rgb")
    wavelengths = np.arange(390.0, 711.0)
    film = Filmed(
        np.interp(wavelengths, *tabulated_index("Al")), 1.77, 2 * np.pi * thickness / wavelengths
    )
    weights = linear_srgb(response(wavelengths))
    expected = normal_reflectance(film) @ (weights / weights.sum(axis=0))
    bsdf = load(material="Al", film_ior=1.77, film_thickness=thickness)
    si = dr.zeros(mi.SurfaceInteraction3f)
    found = np.array(bsdf.eval_diffuse_reflectance(si)).ravel()
    # aluminium's index, linear between three colours; of equal energy instead of daylight 2 to 4 %
    assert found == pytest.approx(expected, rel=5e-3)
