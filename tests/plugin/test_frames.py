"""Which way the patch lies: turned with the surface, by `orientation`, on both sides."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from tests.support.gentle import PATCH, load, pairs
from tests.support.lanes import brdf_values, evaluated


def test_orientation_turns_the_patch_anticlockwise(variant):
    # a patch turned by 90°: what lay along +x now lies along +y. The power of an ensemble does
    # not care where the turned patch starts.
    turned = md.HeightField(np.rot90(PATCH.heights, -1), PATCH.pixel_size[::-1])
    wi, wo, lam = pairs(field=turned)
    by_parameter = brdf_values(load(orientation=90.0, tolerance=1e-5), wi, wo, lam[:, None])
    by_hand = brdf_values(load(turned, tolerance=1e-5), wi, wo, lam[:, None])
    # both are built to 1e-5; sin and cos in single precision shift frequencies by 1e-7 of them
    assert np.sum(np.abs(by_parameter - by_hand)) < 2e-5 * np.sum(by_hand)
    unturned = brdf_values(load(), wi, wo, lam[:, None])
    dim = by_hand < 0.01 * by_hand.max()  # what is not the mirror's lobe, the same either way
    assert np.sum(np.abs(unturned - by_hand)[dim]) > 0.5 * np.sum(by_hand[dim])


def test_turning_the_sample_is_turning_the_lamp_and_the_eye_back(variant):
    angle = np.radians(37.0)
    rotation = np.array(
        [[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    wi, wo, lam = pairs()
    turned = brdf_values(load(orientation=37.0), wi @ rotation.T, wo @ rotation.T, lam[:, None])
    plain = brdf_values(load(), wi, wo, lam[:, None])
    # directions are rounded to 6e-8 after turning, by up to 1e-5 of a bin
    assert np.sum(np.abs(turned - plain)) < 1e-4 * np.sum(plain)


def test_both_sides_of_a_sheet(variant):
    one, two = load(), mi.load_dict({"type": "twosided", "bsdf": load()})
    wi, wo, lam = pairs()
    front = evaluated(one, wi, wo, lam[:, None])
    assert np.array_equal(evaluated(two, wi, wo, lam[:, None]), front)
    back = evaluated(two, wi * [1, 1, -1], wo * [1, 1, -1], lam[:, None])
    assert np.array_equal(back, front)
