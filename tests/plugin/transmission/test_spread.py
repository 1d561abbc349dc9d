"""Light of steep slopes that goes through: what scales leave out of R + T is spread."""

from __future__ import annotations

import math
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.tables.energy import sides
from mitsuba_diffraction.tables.energy import store as kept
from mitsuba_diffraction.tables.energy.links import Medium
from tests.support.chi_square import DISPERSED, SMALL, Case, chi_square
from tests.support.coarse import coarse_energy
from tests.support.directions import as_single
from tests.support.lanes import evaluated
from tests.support.layered import pairs
from tests.support.transmitting import BELOW, INDICES, SIDES, OneSide, both, sampled
from tests.support.variants import evaluate, runs

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]


def steep(kind: str, width: float = 20.0, **parameters: Any) -> Any:
    """A blazed grating, with and against whose facets light behaves differently."""
    grating = md.gratings.blazed(2.5, 0.25, periods=math.ceil(width / 2.5), pixels_per_period=28)
    given = {"energy_conserving": True, "coherence_width": width} | SIDES[kind] | parameters
    return both(field=grating, **given)


@pytest.mark.parametrize(("kind", "theta"), [("dielectric", 110.0), ("sheet", 70.0)])
def test_what_scales_leave_out_is_spread(kind, theta):
    mi.set_variant("llvm_ad_mono")
    raw, conserved = (steep(kind, 40.0, energy_conserving=e) for e in (False, True))
    surface = sides.Sides(raw.table, 1.0, Medium(1.5, "small_slope", kind == "sheet"))
    along = np.radians([min(theta, 180.0 - theta)]), np.radians([20.0, 200.0])
    expected = surface.sums(None, *along, 550.0)[0][int(theta > 90.0), 0]
    # sums know with and against the facets apart, and are linear between nodes
    assert abs(expected[0] - expected[1]) > 0.03
    for azimuth, one in zip((20.0, 200.0), expected, strict=True):
        weights, _ = sampled(raw, theta, 1 << 15, azimuth)
        error = 3 * weights.std() / np.sqrt(len(weights))
        assert weights.mean() == pytest.approx(one, abs=error + 0.005)
        weights, _ = sampled(conserved, theta, 1 << 15, azimuth)
        error = 3 * weights.std() / np.sqrt(len(weights))
        # a scale bends over lobes of 40 µm
        assert 0.97 - error < weights.mean() < 1.01 + error


@pytest.mark.parametrize("kind", SIDES)
def test_what_is_spread_is_reciprocal(some_variant, monkeypatch, kind):
    coarse_energy(monkeypatch.setattr)
    bsdf = steep(kind)
    assert bsdf.through.balance.spreads
    wi, wo, lam = (a[:200] for a in pairs())
    for first, second, factor in (
        (wi, wo * BELOW, 2.25 if kind == "dielectric" else 1.0),
        (wi * BELOW, wo * BELOW, 1.0),
    ):
        there = evaluated(bsdf, first, second, lam) / np.abs(second[:, 2:])
        back = evaluated(bsdf, second, first, lam) / np.abs(first[:, 2:])
        assert factor * there == pytest.approx(back, rel=2e-4, abs=2e-6 * back.max())


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("kind", "theta"), [("dielectric", 125.0), ("sheet", 70.0)])
def test_the_density_is_that_of_samples_that_are_spread(
    some_variant, monkeypatch, kind, theta, side
):
    coarse_energy(monkeypatch.setattr)
    parameters = SMALL | INDICES | SIDES[kind] | {"energy_conserving": True}
    grating = md.gratings.blazed(2.0, 0.3, periods=3, pixels_per_period=24)
    case = Case(grating, theta, DISPERSED, parameters)
    bsdf = case.load()
    assert bsdf.through.balance.spreads
    test = chi_square(OneSide(bsdf, side), case, samples=1 << 19)
    assert test.run(0.01, 8, quiet=True), test.messages


@pytest.mark.parametrize("name", ["scalar_spectral", "llvm_ad_rgb", "llvm_ad_spectral_polarized"])
def test_variants_evaluate_what_they_spread(name, monkeypatch):
    if not runs(name):
        pytest.skip(f"{name}: Dr.Jit finds no device for it")
    mi.set_variant(name)
    coarse_energy(monkeypatch.setattr)
    monkeypatch.setattr(sides, "WAVELENGTHS", (4, 4))  # one of them red
    monkeypatch.setattr(kept, "_SIDES", ("red", *kept._SIDES))  # others keep theirs
    wi, wo, lam = (a[:8] for a in pairs())
    samples, wo = as_single(np.random.default_rng(2).random((8, 3))), as_single(wo * BELOW)
    value, pdf, again, pdf_again, *_ = evaluate(steep("sheet"), wi, wo, samples, lam)
    plain, *_ = evaluate(steep("sheet", energy_conserving=False), wi, wo, samples, lam)
    assert np.all(np.isfinite(value))
    assert np.any(value > 1.5**2 * plain)  # more than by any scale
    assert again == pytest.approx(value, rel=1e-5)
    assert pdf_again == pytest.approx(pdf, rel=1e-5)
