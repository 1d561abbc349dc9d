"""Descriptions of surfaces: complete, and shown or refused by each consumer; nothing is dropped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import mitsuba_diffraction as md
from mitsuba_diffraction.analysis.maps.evaluate import MAPS
from mitsuba_diffraction.analysis.spectra import SPECTRA
from mitsuba_diffraction.osl.export import OSL, shader_of
from mitsuba_diffraction.plugin.description import (
    Feature,
    Quantity,
    Surface,
    describe,
)
from mitsuba_diffraction.realtime.glsl.export import SHADER
from mitsuba_diffraction.realtime.glsl.maps import axis_map
from mitsuba_diffraction.realtime.glsl.methods import METHODS
from mitsuba_diffraction.realtime.glsl.shader_materials import (
    GLSL,
    pack_conservation,
    pack_surface,
    packed_by,
)
from mitsuba_diffraction.realtime.glsl.shader_materials import ShaderMaterial as Drawn
from mitsuba_diffraction.tables.directional import FINE, DirectionalTable
from tests.support.orders import thin_grating
from tests.support.patches import DEFAULTS, PATCH

ALL = [GLSL, SHADER, OSL, MAPS, SPECTRA, *(m.consumer() for m in METHODS.values() if m.consumer)]
TABLE = md.DiffractionTable.build(PATCH, **DEFAULTS)
TEXTURE = object()  # stands for an object of Mitsuba, which features do not read


def half(height_scale: float) -> DirectionalTable:
    return DirectionalTable(np.array([400.0, 700.0]), np.stack([0.5 * FINE.ones] * 2))


def constant(index: float) -> Callable:
    return lambda lam: np.full(lam.shape, index + 0j)


def base() -> Surface:
    return Surface(
        TABLE, "dielectric", DEFAULTS["coherence_width"], Quantity(0.0), kind=Feature.DIELECTRIC,
        index=constant(1.5), model="small_slope", largest_scale=1.5,
    )  # fmt: skip


#: Change of the description that gives a surface the feature.
CHANGES: Mapping[Feature, dict] = {
    Feature.TRANSMISSION: {"transmits": True},
    Feature.MIRROR: {"kind": Feature.MIRROR, "index": None, "model": "kirchhoff"},
    Feature.RARER: {"kind": Feature.RARER, "index": constant(0.8)},
    Feature.CONDUCTOR: {"kind": Feature.CONDUCTOR, "index": lambda lam: 0.01 * lam / 5 + 6j},
    Feature.COAT: {"coat": 1.4},
    Feature.FILM: {"layer": Feature.FILM},
    Feature.VARYING_FILM: {"film_varies": True},
    Feature.KIRCHHOFF: {"model": "kirchhoff"},
    Feature.OWN_MODEL: {"model": "level"},
    Feature.ENERGY_SCALE: {"energy_scale": half},
    Feature.SHADOWING: {"shadowing": True},
    Feature.PATCH: {"coherence": "patch"},
    Feature.PLACED: {"coherence": "surface"},
    Feature.HEIGHT_SCALE: {"height_scale": Quantity(0.5)},
    Feature.VARYING_HEIGHT: {"height_scale": Quantity(1.0, TEXTURE)},
    Feature.LATERAL_SCALE: {"lateral_scale": Quantity(0.5)},
    Feature.VARYING_LENGTH: {"lateral_scale": Quantity(1.0, TEXTURE)},
    Feature.ORIENTATION: {"orientation": Quantity(30.0)},
    Feature.VARYING_ORIENTATION: {"orientation": Quantity(0.0, TEXTURE)},
    Feature.NESTED: {"nested": TEXTURE},
}


@pytest.mark.parametrize("feature", CHANGES)
def test_feature_is_that_of_the_description(feature):
    assert feature not in base().features()
    assert feature in replace(base(), **CHANGES[feature]).features()


@settings(deadline=None, max_examples=200)
@given(st.sets(st.sampled_from(list(CHANGES))), st.sampled_from(ALL))
def test_consumer_shows_a_feature_or_refuses_it_in_one_line(chosen, consumer):
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


def of_osl(described: Surface) -> object:
    if described.nested is not None:
        described = replace(described, nested=mi.load_dict({"type": "diffuse"}))
    shader = shader_of(described)
    arrays = {name: pixels.tobytes() for name, pixels in shader.textures.items()}
    return shader.formulas, shader.constants, list(shader.arrays), shader.sockets, arrays


def of_shaders(described: Surface) -> object:
    drawn = Drawn(axis_map(described), packed_by(described), axis=axis_map(described))
    packed = pack_surface(drawn) | pack_conservation(drawn)
    textures = {texture.name: texture.data.tobytes() for texture in packed.textures}
    scale, axis = described.height_scale.number, axis_map(described).value.tolist()
    return packed.uniforms, packed.definitions, textures, scale, axis


#: Features of tables, mixes, textures, users' models and variants: tests of these show them.
ELSEWHERE = {
    Feature.HEIGHTS, Feature.ORDERS, Feature.MIX, Feature.LIMITED, Feature.PATCH,
    Feature.VARYING_WEIGHTS, Feature.VARYING_LENGTH, Feature.VARYING_ORIENTATION,
    Feature.DIELECTRIC, Feature.SMALL_SLOPE, Feature.OWN_MODEL, Feature.OPAQUE, Feature.COLOURS,
}  # fmt: skip


@pytest.mark.parametrize(
    ("consumer", "packed"), [(OSL, of_osl), (GLSL, of_shaders)], ids=["osl", "glsl"]
)
def test_every_feature_that_is_shown_changes_what_is_exported(consumer, packed, some_variant):
    plain = packed(base())
    for feature in consumer.shows - ELSEWHERE:
        assert packed(replace(base(), **CHANGES[feature])) != plain, feature


ALUMINIUM = {"eta": 0.9, "k": 6.0}
PARAMETERS = [
    ({"material": "none"}, Feature.MIRROR),
    (ALUMINIUM, Feature.CONDUCTOR),
    ({"int_ior": 1.2, "ext_ior": 1.5}, Feature.RARER),
    ({"coat_ior": 1.3}, Feature.COAT),
    ({"film_ior": 1.3, "film_thickness": 100.0}, Feature.FILM),
    (
        {
            "film_ior": 1.3,
            "film_thickness": {"type": "checkerboard"},
            "film_thickness_max": 200.0,
        },
        Feature.VARYING_FILM,
    ),
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
