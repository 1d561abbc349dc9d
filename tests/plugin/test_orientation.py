"""What `orientation` refuses, in all variants, and that what it takes means the same."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.plugin.description import describe
from mitsuba_diffraction.plugin.varying import PRECISION
from tests.support.gentle import load, pairs
from tests.support.lanes import evaluated, refusal


def bitmap(degrees, raw=True, channels=3, levels=None):
    """Four directions; of an integer format, which clips, where it has so many `levels`."""
    angles = np.deg2rad(np.reshape(degrees, (2, 2, 1)))
    data = np.concatenate([np.cos(angles), np.sin(angles), 0 * angles], axis=2)[..., :channels]
    if levels:
        data = np.rint(np.clip(data, 0.0, 1.0) * levels) / levels
    return {"type": "bitmap", "raw": raw, "data": mi.TensorXf(data.astype(np.float32))}


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
    said = refusal(lambda: load(orientation=bitmap([10.0, 120.0, 200.0, 300.0], **texture)))
    assert said.startswith("orientation: ")
    assert __import__("re").search(mend, said)


@pytest.mark.parametrize("degrees", [0.0, 53.13010235, 90.0, 45.0])
def test_directions_that_integers_could_hold_are_taken(some_variant, degrees):
    """(0.6, 0.8) is a multiple of 1/255: no reason to refuse it."""
    wi, wo, lam = pairs(20)
    textured = load(orientation=bitmap([degrees] * 4))
    expected = evaluated(load(orientation=degrees), wi, wo, lam[:, None])
    found = evaluated(textured, wi, wo, lam[:, None])
    # the angle's sine in single precision, times kσ = 16
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-5 * expected.max())


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("degrees", [10.0, 120.0, 200.0, 300.0])
def test_integers_hold_directions_to_the_stated_precision(some_variant, bits, degrees):
    levels, angle = 2**bits - 1, np.deg2rad(degrees)
    doubled = np.array([1.0 + np.cos(angle), 1.0 + np.sin(angle), 1.0]) / 2.0
    data = np.tile(np.rint(doubled * levels) / levels, (2, 2, 1)).astype(np.float32)
    texture = {"type": "bitmap", "raw": True, "data": mi.TensorXf(data)}
    bsdf = load(orientation=texture)
    si = dr.zeros(mi.SurfaceInteraction3f)
    cos, sin, _ = (np.ravel(x)[0] for x in describe(bsdf).frame(si))
    error = np.degrees(np.angle(np.exp(1j * (np.arctan2(sin, cos) - angle))))
    assert abs(error) < PRECISION[bits] + 2e-5  # the angle in single precision
    assert f"within {PRECISION[8]:.2g}° in 8 bits" in str(bsdf)


def test_the_middle_of_a_picture_of_8_bits_turns_nothing(some_variant):
    data = np.full((2, 2, 3), 128 / 255, np.float32)
    bsdf = load(orientation={"type": "bitmap", "raw": True, "data": mi.TensorXf(data)})
    cos, sin, _ = (np.ravel(x)[0] for x in describe(bsdf).frame(dr.zeros(mi.SurfaceInteraction3f)))
    assert (cos, sin) == (1.0, 0.0)


@pytest.mark.parametrize("degrees", [1e30, -40_000.0])
def test_angles_without_digits_are_refused(every_variant, degrees):
    assert "at least -36000° and at most 36000°" in refusal(lambda: load(orientation=degrees))
