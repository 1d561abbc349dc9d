"""Parts that all shaders share: a pair of directions, the coat, speckle, gloss, and the display."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.testing import assert_allclose

from mitsuba_diffraction import HeightField, bsdf_dict, reference
from mitsuba_diffraction.optics.display import VIEWS, shown
from mitsuba_diffraction.plugin.description import Surface
from mitsuba_diffraction.realtime.glsl.diffracting import pack_constants, pack_table
from mitsuba_diffraction.realtime.glsl.export import make_shader
from mitsuba_diffraction.realtime.glsl.features import GLSL
from mitsuba_diffraction.realtime.glsl.maps import axis_map
from mitsuba_diffraction.realtime.glsl.shader_materials import ShaderMaterial, pack_surface
from mitsuba_diffraction.realtime.glsl.source import display_definitions, joined, source_parts
from mitsuba_diffraction.realtime.glsl.texels import Packed, Texture
from tests.realtime.glsl.shaders import difference, drawn, paired, probed, shaded
from tests.support.descriptions import CHANGES, ELSEWHERE, base
from tests.support.directions import polar
from tests.support.kinds import COATED, SLOPE
from tests.support.lanes import interaction, vectors
from tests.support.layered import PATCH, WIDTH, load, pairs
from tests.support.pictures import largest_difference, ramp

STRETCH, WAVELENGTH = 0.7, 550.0


def test_a_stretched_patch_under_a_coat_has_the_reference_s_light(gl: Any) -> None:
    mi.set_variant("scalar_spectral_polarized")
    surface = load(**COATED[0]).describe()
    wi, wo, _ = pairs()
    wi, wo = wi[::3], wo[::3]
    near = np.arange(len(wi)) < 30
    parts = pack_constants(surface) | pack_table(surface, "exact") | paired(wi, wo) | Packed(
        uniforms={"height_scale": 1.0, "wavenumber": 2e3 * np.pi / WAVELENGTH},
        definitions={"MONOCHROME": ""},
    )  # fmt: skip
    found = probed(gl, "exact", parts, np.full((len(wi), 4), STRETCH))[:, 0]
    given = {"coherence_width": WIDTH * STRETCH} | COATED[1] | SLOPE
    expected = reference.brdf(PATCH.stretched(STRETCH), wi, wo, WAVELENGTH, **given) * wo[:, 2]
    for part in (near, ~near):
        # cut windows, and a conductor's index between 96 wavelengths
        assert difference(found[part], expected[part]) < 5e-3


@pytest.mark.parametrize("given", [{"material": "none"}, {"int_ior": 1.8, "model": "kirchhoff"}])
def test_scaled_light_vanishes_at_the_horizon(
    gl: Any, patch: HeightField, given: dict[str, Any]
) -> None:
    """As in the plugin: beyond the tables' last angle an albedo above 1 rises on."""
    mi.set_variant("llvm_ad_rgb")
    rng = np.random.default_rng(5)
    wi = np.array([polar(*rng.uniform((50, 0), (85, 360))) for _ in range(300)])
    factors = []
    for theta in (89.0, 89.7, 89.9):
        wo = np.array([polar(theta, phi) for phi in rng.uniform(0, 360, 300)])
        si, light = interaction(wi, np.zeros((300, 4))), []
        for conserving in (False, True):
            surface = bsdf_dict(patch, coherence_width=6.5, energy_conserving=conserving, **given)
            bsdf = mi.load_dict(surface)
            expected = np.array(bsdf.eval(mi.BSDFContext(), si, vectors(wo)))[1]
            light.append((shaded(gl, make_shader(bsdf, ["fast"]), wi, wo)[:, 1], expected))
        found, expected = (after.sum() / before.sum() for before, after in zip(*light, strict=True))
        # one scale for all colours here, and one for each there
        assert_allclose(found, expected, rtol=0.02)
        factors.append(found)
    assert factors[2] < 0.1 < 0.7 < factors[0]


def packed_of(described: Surface) -> object:
    packed = pack_surface(ShaderMaterial(axis_map(described), described, axis=axis_map(described)))
    textures = {texture.name: texture.data.tobytes() for texture in packed.textures}
    scale, axis = described.height_scale.number, axis_map(described).value.tolist()
    return packed.uniforms, packed.definitions, textures, scale, axis


def test_every_feature_that_is_shown_changes_what_is_packed(some_variant: str) -> None:
    plain = packed_of(base())
    for feature in GLSL.shows - ELSEWHERE:
        assert packed_of(replace(base(), **CHANGES[feature])) != plain, feature


SHOW = """
uniform sampler2D light;
out vec4 fragment;
void main() { fragment = vec4(displayed(texelFetch(light, ivec2(gl_FragCoord.xy), 0).rgb), 1.0); }
"""


@pytest.mark.parametrize("view", VIEWS)
def test_shader_and_numpy_show_the_same(gl, view):
    light = ramp()
    rows, columns, _ = light.shape
    files = ("library.glsl", "formulas", "shown.frag")
    source = joined(source_parts(files, display_definitions(view)))
    source = source.partition("// Picture of a page")[0] + SHOW
    parts = Packed((Texture("light", np.pad(light, [(0, 0)] * 2 + [(0, 1)])),))
    found = drawn(gl, source, parts, (columns, rows)).reshape(light.shape)
    expected = shown(light, view)
    # single precision with a driver's powers; 1/255 is a step of a screen
    assert np.abs(found - expected).max() < 1e-3
    assert largest_difference(expected, found) < 0.5
