"""Textures and attributes of `orientation`, what it refuses in all variants; and shadowing."""

from __future__ import annotations

import re

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.plugin.description import describe
from mitsuba_diffraction.plugin.varying import PRECISION
from tests.support.gentle import directions, load, pairs
from tests.support.lanes import bitmap, evaluated, refusal


@pytest.mark.parametrize(
    ("texture", "mend"),
    [
        ({"raw": False}, "raw"),
        ({"channels": 1}, "has three"),
        ({"levels": 255}, r"save \(1 \+ cos\)/2 .* as EXR"),
        ({"levels": 65535}, r"save \(1 \+ cos\)/2 .* as EXR"),
    ],
)
def test_a_picture_that_holds_no_directions_is_refused(every_variant, texture, mend):
    said = refusal(lambda: load(orientation=directions([10.0, 120.0, 200.0, 300.0], **texture)))
    assert said.startswith("orientation: ")
    assert re.search(mend, said)


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("degrees", [10.0, 120.0, 200.0, 300.0])
def test_integers_hold_directions_to_the_stated_precision(some_variant, bits, degrees):
    levels, angle = 2**bits - 1, np.deg2rad(degrees)
    doubled = np.array([1.0 + np.cos(angle), 1.0 + np.sin(angle), 1.0]) / 2.0
    bsdf = load(orientation=bitmap(np.tile(np.rint(doubled * levels) / levels, (2, 2, 1))))
    si = dr.zeros(mi.SurfaceInteraction3f)
    cos, sin, _ = (np.ravel(x)[0] for x in describe(bsdf).frame(si))
    error = np.degrees(np.angle(np.exp(1j * (np.arctan2(sin, cos) - angle))))
    assert abs(error) < PRECISION[bits] + 2e-5  # the angle in single precision
    assert f"within {PRECISION[8]:.2g}° in 8 bits" in str(bsdf)


def test_the_middle_of_a_picture_of_8_bits_turns_nothing(some_variant):
    bsdf = load(orientation=bitmap(np.full((2, 2, 3), 128 / 255)))
    cos, sin, _ = (np.ravel(x)[0] for x in describe(bsdf).frame(dr.zeros(mi.SurfaceInteraction3f)))
    assert (cos, sin) == (1.0, 0.0)


@pytest.mark.parametrize("degrees", [1e30, -40_000.0])
def test_angles_without_digits_are_refused(every_variant, degrees):
    assert "at least -36000° and at most 36000°" in refusal(lambda: load(orientation=degrees))


@pytest.mark.thorough
def test_vcavity_is_its_formula_and_none_is_the_default(some_variant):
    wi, wo, lam = pairs(500)
    plain, shadowed = (
        evaluated(load(**given), wi, wo, lam[:, None]) for given in ({}, {"shadowing": "vcavity"})
    )
    half = (wi + wo) / np.linalg.norm(wi + wo, axis=1, keepdims=True)
    across = np.sum(wo * half, axis=1)
    factor = np.minimum(1.0, 2.0 * half[:, 2] * np.minimum(wi[:, 2], wo[:, 2]) / across)
    assert factor.min() < 0.5  # or the test would say little
    # order 0 is a mirror's lobe, which grooves do not shadow; of 4.5 µm it reaches 0.5
    others = np.hypot(*(wi + wo)[:, :2].T) > 0.5
    expected = (plain * factor[:, None])[others]
    assert shadowed[others] == pytest.approx(expected, rel=1e-4, abs=1e-6 * float(plain.max()))
