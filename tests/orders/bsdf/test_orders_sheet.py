"""The BSDF `diffraction_orders` of a thin sheet: light on both sides."""

from __future__ import annotations

import itertools

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from tests.support.orders import (
    lit_pairs,
    load,
    on_all_sides,
    reference_on_all_sides,
    thin_grating,
)
from tests.support.variants import evaluate

SHEET = thin_grating(thin=True)


def test_values_are_the_references_on_both_sides_and_weights_are_one(some_variant):
    wi, wo, samples, wavelength = lit_pairs(80)
    wavelength[:] = wavelength[:, :1]
    wi, wo = on_all_sides(wi, wo)
    values, pdf, again, pdf_again, drawn, _, weights = evaluate(
        load(SHEET), wi, wo, samples, wavelength
    )
    expected = reference_on_all_sides(SHEET, wi, wo, wavelength[:, 0])
    # linear interpolation between the corners of cells
    assert np.abs(values[:, 0] - expected).sum() <= 1e-3 * expected.sum()
    assert np.array_equal(values, again)
    assert np.array_equal(pdf, pdf_again)
    steps = np.arange(-5, 6)[:, None]
    albedo = sum(
        np.where(
            (wi[:, 2] < 0.0) == from_below,
            SHEET.efficiency(
                -wi[:, 0], -wi[:, 1], wavelength[:, 0], steps,
                from_below=from_below, transmitted=transmitted,
            ).sum(axis=0),
            0.0,
        )
        for from_below, transmitted in itertools.product((False, True), (False, True))
    )  # fmt: skip
    # drawn exactly: half floats are rounded up
    valid = weights[:, 0] > 0.0
    assert valid.mean() > 0.9
    far = valid & (np.minimum(np.abs(wi[:, 2]), np.abs(drawn[:, 2])) > 0.2)  # where C is 1
    assert far.mean() > 0.7
    assert weights[far, 0] == pytest.approx(albedo[far], rel=3e-3)
    assert (drawn[valid, 2] * wi[valid, 2] < 0.0).mean() == pytest.approx(0.72, abs=0.15)


@pytest.mark.parametrize("component", [0, 1])
def test_a_component_is_the_light_of_its_side(some_variant, component):
    wi, wo, samples, wavelength = lit_pairs(40)
    wi, wo = on_all_sides(wi, wo)
    whole = evaluate(load(SHEET), wi, wo, samples, wavelength)[0]
    part = evaluate(load(SHEET), wi, wo, samples, wavelength, component)
    passed = wi[:, 2] * wo[:, 2] < 0.0
    assert np.array_equal(part[0], np.where((passed == component)[:, None], whole, 0.0))
    sides = part[4][:, 2] * wi[:, 2] < 0.0
    assert np.all(part[5][sides != component] == 0.0)


def test_no_bsdf_lies_beneath_a_sheet(some_variant):
    with pytest.raises(Exception, match="thin sheet") as caught:
        load(SHEET, beneath={"type": "diffuse"})
    assert isinstance(caught.value.__cause__ or caught.value, (DiffractionError, RuntimeError))
    assert mi.has_flag(load(SHEET).flags(), mi.BSDFFlags.GlossyTransmission)
