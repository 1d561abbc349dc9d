"""Every variant of Mitsuba that this machine runs: the same light, in its own numbers."""

from __future__ import annotations

from typing import Any

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionTable, HeightField, bsdf_dict, reference
from mitsuba_diffraction.optics.colour import RGB_WAVELENGTHS, delta_e, linear_srgb, response
from mitsuba_diffraction.plugin import materials
from mitsuba_diffraction.tables.colour import ColourTable
from tests.support.directions import Array, polar
from tests.support.lanes import interaction, spectra, vectors
from tests.support.layered import PATCH, WIDTH, load, pairs
from tests.support.variants import ALL, evaluate, use

pytestmark = pytest.mark.thorough


def lit() -> tuple[Array, Array, Array, Array]:
    """Incident and outgoing directions, wavelengths of the current variant, and samples."""
    wi, wo, lam = pairs()
    high = np.flatnonzero(np.minimum(wi[:, 2], wo[:, 2]) > 0.3)[::2]
    wi, wo, lam = wi[high], wo[high], lam[high]
    lam = lam if mi.is_spectral else np.full_like(lam, 600.0)
    return wi, wo, lam, np.random.default_rng(3).random((len(wi), 3))


RGB = [name for name in ALL if "rgb" in name]


@pytest.mark.parametrize("name", RGB)
def test_colours_are_those_of_the_table(name: str) -> None:
    use(name)
    wi, wo, lam, samples = lit()
    value = evaluate(load(material="none"), wi, wo, samples, lam)[0]
    table = DiffractionTable.build(PATCH, coherence_width=WIDTH, tolerance=1e-4)
    u, v, w = (wi + wo).T
    outside = ((1.0 + (wi * wo).sum(axis=1)) / w) ** 2 / wi[:, 2]
    colours = ColourTable.build(table).colour(u, v, w)
    truth = 4.0 * np.pi * table.sigma**2 * outside[:, None] * colours
    # colours of a table lack the lobe of order 0 as the horizon sees it
    far = np.hypot(u, v) > 0.6
    # single precision: a phase of some hundred radians across the window has an error of 1e-4
    assert value[far] == pytest.approx(truth[far], rel=2e-3, abs=2e-5 * np.abs(truth).max())


def test_in_rgb_a_channel_has_the_boundary_of_one_wavelength() -> None:
    use("llvm_ad_rgb")
    wi, wo, lam = pairs(24)
    samples = np.full((len(wi), 3), 0.5)
    small, mirror = (
        evaluate(load(**given), wi, wo, samples, lam)[0] for given in ({}, {"material": "none"})
    )
    for n, one in enumerate(RGB_WAVELENGTHS):
        exact, perfect = (
            reference.brdf(PATCH, wi, wo, one, coherence_width=WIDTH, **given)
            for given in ({"model": "small_slope", "eta": 1.5 / 1.000277}, {})
        )
        bright = (perfect > 1e-4 * perfect.max()) & (np.abs(mirror[:, n]) > 1e-4 * mirror.max())
        assert bright.sum() > len(wi) // 4
        found = small[bright, n] / mirror[bright, n]
        assert found == pytest.approx((exact / perfect)[bright], rel=1e-3)


def test_gold_has_the_colour_of_its_spectrum(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nearer than with one reflectance a channel, which lines of light do not all share."""
    use("llvm_ad_spectral")  # scalar variants would take minutes
    wi, wo, *_ = lit()
    lines = np.arange(362.5, 780.0, 5.0, np.float32).reshape(-1, 4)
    bsdf, truth = load(material="Au"), np.zeros((len(wi), 3))
    for group in lines:
        si = interaction(wi, np.tile(group, (len(wi), 1)))
        value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T))).T
        truth += 5.0 * value @ linear_srgb(response(group))
    use("llvm_ad_rgb")
    errors = []
    for tinted in (True, False):
        with monkeypatch.context() as patch:
            if not tinted:
                patch.setattr(materials, "metal_tint", lambda *_: np.eye(3))
            si = interaction(wi, lines)
            found = np.array(load(material="Au").eval(mi.BSDFContext(), si, mi.Vector3f(wo.T))).T
        errors.append(delta_e(truth, found, least=1e-3))
    assert np.nanmean(errors[0]) < 0.7 * np.nanmean(errors[1])


@pytest.mark.parametrize(
    ("options", "low", "high", "side", "index"),
    [
        pytest.param({"material": "none"}, 70, 80, 1, 1.0, id="reflected"),
        pytest.param({"type": "diffraction_dielectric"}, 0, 60, -1, 1.5, id="refracted"),
        pytest.param({"type": "diffraction_dielectric", "thin": True}, 0, 60, -1, 1.0, id="sheet"),
    ],
)
def test_orders_of_one_window_interfere_in_colours_as_in_a_spectrum(
    options: dict[str, Any], low: float, high: float, side: int, index: float
) -> None:
    """Beats go with the factors of both: of order 0, and of the others."""
    ramp = np.tile(np.linspace(0.0, 0.3, 50), (8, 1))
    field = HeightField(ramp, 0.05, periodic=True)
    patch = {"coherence": "patch", "coherence_width": 3.0, "energy_conserving": False}
    surface = bsdf_dict(field, **patch, **options)
    rng, lines = np.random.default_rng(5), np.arange(378.0, 738.0, 2.0)
    wi = np.array([polar(*rng.uniform((low, 0), (high, 360))) for _ in range(20)])
    x, y = (rng.normal(0.0, 0.1, (20, 2)) - wi[:, :2] / index).T
    wo = np.stack([x, y, side * np.sqrt(np.maximum(1.0 - x**2 - y**2, 0.0))], axis=1)
    mi.set_variant("llvm_ad_spectral")
    si = interaction(np.repeat(wi, 45, axis=0), np.tile(lines.reshape(-1, 4), (20, 1)))
    value = mi.load_dict(surface).eval(mi.BSDFContext(), si, vectors(np.repeat(wo, 45, axis=0)))
    colours = linear_srgb(response(lines))
    truth = spectra(value).reshape(20, 180) @ (colours / colours.sum(axis=0))
    mi.set_variant("llvm_ad_rgb")
    si = interaction(wi, np.zeros((20, 4)))
    found = np.array(mi.load_dict(surface).eval(mi.BSDFContext(), si, vectors(wo))).T
    # rings and series of colours, 0.4 %; light let through is 0.9 % off without its beats
    assert np.abs(found - truth).mean() < 0.006 * truth.mean()
