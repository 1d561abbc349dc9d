"""A plate's shader against the plugin: one direction of view, one of light."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_diffraction as md
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.realtime.glsl.renderer import Renderer
from mitsuba_diffraction.reference.fresnel import reflectance
from tests.support.lanes import interaction, spectra, vectors

pytestmark = pytest.mark.thorough

#: Direction towards the eye in the plate's frame, and columns of a vertex that hold its colour.
VIEW = np.array([0.0, -0.6, 0.8])
COLOUR = slice(11, 14)


def test_what_lies_beneath_gets_the_light_that_the_table_leaves(
    gl: Any, table_file: Path, some_variant: str
) -> None:
    white = {"type": "diffuse", "reflectance": 1.0}
    skin = {"type": "diffraction", "filename": str(table_file), "int_ior": 2.5, "orientation": 25.0}
    plate = mi.load_dict({**skin, "nested": white})
    wo = np.array([-0.6, 0.64, 0.48])
    parameters = mi.traverse(plate)
    parameters["height_scale"] = 1.25
    parameters.update()
    drawn = pigment_of(gl, plate, wo)
    np.testing.assert_allclose(drawn, beneath(plate, wo), rtol=4e-4)  # half floats
    flat = np.prod([1.0 - reflectance(cos, 2.5 / 1.000277) for cos in (wo[2], VIEW[2])])
    assert np.abs(drawn / (wo[2] / np.pi * flat) - 1.0).min() > 4e-3


def pigment_of(gl: Any, plate: Any, wo: NDArray[np.float64]) -> NDArray[np.float64]:
    """What a plate's shader adds for a white pigment beneath, over the light's irradiance."""
    made = Renderer(mi.load_dict(under_a_sun(plate, wo)), context=gl)
    (surface,), (buffer,) = made.scene.surfaces, made.buffers
    vertices, pictures = surface.vertices.copy(), []
    for pigment in (1.0, 0.0):
        vertices[:, COLOUR] = pigment
        buffer.write(vertices.tobytes())
        pictures.append(made.render("exact", supersampling=1)[1, 1, :3].astype(float))
    found = (pictures[0] - pictures[1]) / made.lights[0].colour
    made.release()
    return np.asarray(found)


def under_a_sun(plate: Any, wo: NDArray[np.float64]) -> dict[str, Any]:
    """A plate seen along `VIEW`, lit along wo."""
    return {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "fov": 0.1,
            "to_world": mi.ScalarTransform4f().look_at(list(100.0 * VIEW), [0, 0, 0], [0, 0, 1]),
            "film": {"type": "hdrfilm", "width": 4, "height": 4},
        },
        "plate": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(9), "bsdf": plate},
        "sun": {"type": "directional", "direction": (-wo).tolist(), "irradiance": 1.0},
    }


def beneath(plate: Any, wo: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same by the plugin, over all wavelengths of daylight."""
    lam = np.arange(380.0, 740.0, 5.0)
    si = interaction(np.broadcast_to(VIEW, (len(lam), 3)), lam)
    everywhere = vectors(np.broadcast_to(wo, (len(lam), 3)))
    of_nested = mi.BSDFContext()
    of_nested.component = 1
    found = spectra(plate.eval(of_nested, si, everywhere))[:, 0]
    weights = linear_srgb(response(lam))
    return np.asarray(found @ (weights / weights.sum(axis=0)))


@pytest.mark.parametrize(
    ("name", "method", "material"),
    [
        ("llvm_ad_rgb", "fast", {"int_ior": 1.58}),
        ("llvm_ad_spectral", "exact", {"int_ior": 2.2, "coat_ior": 1.2, "lateral_scale": 0.85}),
    ],
)
@pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")
def test_orders_of_pits_are_the_plugins(
    gl: Any, name: str, method: str, material: dict[str, float]
) -> None:
    mi.set_variant(name)
    turns = np.radians([50, 62, 74, 86, 98, 110])
    pits = md.gratings.cd(4.0, 80)
    bsdf = mi.load_dict(
        md.bsdf_dict(
            pits, coherence_width=12, height_scale=0.9, energy_conserving=False, **material
        )
    )
    made = Renderer(mi.load_dict(under_a_sun(bsdf, turned(turns[0]))), context=gl)
    drawn = []
    for turn in turns:
        made.lights = [dataclasses.replace(made.lights[0], place=(*turned(turn), 0.0))]
        drawn.append(made.render(method, supersampling=1)[1, 1, :3] / made.lights[0].colour)
    made.release()
    expected = np.array([reflected(bsdf, turned(turn)) for turn in turns])
    assert off(np.array(drawn, float), expected) < 0.02


def off(found: NDArray[np.float64], exact: NDArray[np.float64]) -> float:
    """By how much of the exact values' sum."""
    return float(np.abs(found - exact).sum() / np.abs(exact).sum())


def turned(turn: float) -> NDArray[np.float64]:
    """60° from the normal."""
    return np.array([np.cos(turn) * 0.75**0.5, np.sin(turn) * 0.75**0.5, 0.5])


def reflected(bsdf: Any, wo: NDArray[np.float64]) -> NDArray[np.float64]:
    """f·cosθ by the plugin in linear sRGB under daylight, (3,)."""
    lam = np.arange(376.0, 744.0, 0.5) if mi.is_spectral else np.array([550.0])
    si = interaction(np.broadcast_to(VIEW, (len(lam), 3)), lam)
    value = bsdf.eval(mi.BSDFContext(), si, vectors(np.broadcast_to(wo, (len(lam), 3))))
    if not mi.is_spectral:
        return np.array(value, float).ravel()
    return np.asarray(spectra(value)[:, 0] @ (0.5 * linear_srgb(response(lam))))


def test_a_mix_is_drawn_by_its_weights(gl: Any, some_variant: str, table_file: Path) -> None:
    skin = {"type": "diffraction", "filename": str(table_file), "model": "kirchhoff"}
    paint = {"type": "diffuse", "reflectance": 0.7}

    def drawn(bsdf: dict[str, Any]) -> NDArray[np.float32]:
        made = Renderer(mi.load_dict(under_a_sun(bsdf, turned(1.2))), context=gl)
        picture = made.render("fast", supersampling=16)[..., :3]
        made.release()
        return picture

    def mix(weight: Any) -> dict[str, Any]:
        both = {"skin": skin, "paint": paint}
        return {"type": "diffraction_mix", **both, "weight_skin": weight}

    # the plate's middle, where the halves of a texture of two texels meet
    halves = mi.Bitmap(np.array([[1.0, 0.0]], np.float32))
    texture = {"type": "bitmap", "bitmap": halves, "raw": True, "filter_type": "nearest"}
    alone = [drawn(skin), drawn(mix(0.0))]
    picture = drawn(mix(texture))
    for half, expected in ((np.s_[:, :2], alone[0]), (np.s_[:, 2:], alone[1])):
        np.testing.assert_allclose(picture[half], expected[half], rtol=1e-5)
    # blended by a pattern of samples, 256 a pixel: its noise
    blend = 0.25 * alone[0] + 0.75 * alone[1]
    np.testing.assert_allclose(drawn(mix(0.25)).mean((0, 1)), blend.mean((0, 1)), rtol=0.02)
