"""Descriptions of surfaces: complete, and shown or refused by each consumer; nothing is dropped."""

from __future__ import annotations

from dataclasses import replace

import mitsuba as mi
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.description import Consumer, Feature, describe
from tests.support.descriptions import CHANGES, base
from tests.support.orders import thin_grating
from tests.support.patches import DEFAULTS, PATCH

FEATURES = st.frozensets(st.sampled_from(list(Feature)), max_size=4)


@pytest.mark.parametrize("feature", CHANGES)
def test_feature_is_that_of_the_description(feature):
    assert feature not in base().features()
    assert feature in replace(base(), **CHANGES[feature]).features()


@settings(deadline=None, max_examples=200)
@given(st.sets(st.sampled_from(list(CHANGES))), FEATURES, FEATURES)
def test_consumer_shows_a_feature_or_refuses_it_in_one_line(chosen, refused, left_out):
    shows = frozenset(Feature) - refused - left_out
    consumer = Consumer("a printer", shows, left_out=dict.fromkeys(left_out, "paler"))
    changes: dict = {}
    for feature in chosen:
        changes |= CHANGES[feature]
    described = replace(base(), **changes)
    missing = described.features() - consumer.shows - set(consumer.left_out)
    refusal = consumer.refusal(described, "the scale")
    assert (refusal is None) == (not missing)
    if refusal is not None:
        assert len(refusal.splitlines()) == 1
        assert consumer.name in refusal
        assert "the scale has" in refusal
        assert "; " in refusal
        assert any(feature.phrase(described.model) in refusal for feature in missing)


BOARD = {"type": "checkerboard"}
ALUMINIUM = {"eta": 0.9, "k": 6.0}
PARAMETERS = [
    ({"material": "none"}, Feature.MIRROR),
    (ALUMINIUM, Feature.CONDUCTOR),
    ({"int_ior": 1.2, "ext_ior": 1.5}, Feature.RARER),
    ({"coat_ior": 1.3}, Feature.COAT),
    ({"film_ior": 1.3, "film_thickness": 100.0}, Feature.FILM),
    ({"film_ior": 1.3, "film_thickness_max": 200.0, "film_thickness": BOARD}, Feature.VARYING_FILM),
    ({"model": "kirchhoff"}, Feature.KIRCHHOFF),
    ({"shadowing": "vcavity"}, Feature.SHADOWING),
    ({"coherence": "patch"}, Feature.PATCH),
    ({"coherence": "surface", "uv_scale": 10.0}, Feature.PLACED),
    ({"height_scale": 0.5}, Feature.HEIGHT_SCALE),
    ({"lateral_scale": 0.5}, Feature.LATERAL_SCALE),
    ({"orientation": 30.0}, Feature.ORIENTATION),
    ({"beneath": {"type": "diffuse"}}, Feature.NESTED),
    ({"plugin": "diffraction_dielectric"}, Feature.TRANSMISSION),
]


@pytest.mark.parametrize(
    ("parameters", "feature"), PARAMETERS, ids=lambda x: getattr(x, "name", "")
)
def test_every_option_of_a_scene_is_described(parameters, feature, some_variant):
    fixed = {"energy_conserving": False} if "plugin" not in parameters else {}
    bsdf = mi.load_dict(md.bsdf_dict(PATCH, **DEFAULTS, **fixed, **parameters))
    assert feature in describe(bsdf).features()


def test_orders_mixes_and_other_bsdfs(some_variant):
    sheet = mi.load_dict(md.bsdf_dict(thin_grating(0.6, counts=(2, 2, 1), thin=True)))
    assert describe(sheet).features() == {Feature.ORDERS, Feature.TRANSMISSION}
    mix = {"type": "diffraction_mix", "a": sheet, "b": sheet, "weight_a": 0.5}
    assert {Feature.MIX, Feature.TRANSMISSION} <= describe(mi.load_dict(mix)).features()
    assert describe(mi.load_dict({"type": "diffuse"})) is None
