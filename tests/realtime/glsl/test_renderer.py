"""The realtime renderer against Mitsuba's own pictures, and a plate's shader against the plugin."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import binary_erosion

from mitsuba_diffraction import DiffractionWarning
from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.realtime.glsl.renderer import Renderer
from mitsuba_diffraction.realtime.shader_comparison.path_traced import direct_light

pytestmark = pytest.mark.thorough


def sensor(width: int = 60, height: int = 40) -> dict[str, Any]:
    return {
        "type": "perspective",
        "fov": 40,
        "to_world": mi.ScalarTransform4f().look_at([0, -6, 5], [0, 0, 0.2], [0, 0, 1]),
        "film": {"type": "hdrfilm", "width": width, "height": height},
    }


def several_surfaces(table_file: Path, directory: Path) -> dict[str, Any]:
    """A mesh, a sphere, a rectangle, a disk: each with other parameters of the BSDF."""
    x, y = np.meshgrid(np.linspace(0, 1, 9), np.linspace(0, 1, 9))
    mesh = mi.Mesh("wave", 81, 128, has_vertex_normals=True, has_vertex_texcoords=True)
    parameters = mi.traverse(mesh)
    z = 0.1 * np.sin(5 * x + 2 * y)
    positions = np.stack([x - 2.2, 2 * y - 1.4, z], axis=-1)
    parameters["vertex_positions"] = positions.ravel()
    # sheared, so that tangents are neither edges nor perpendicular to anything
    parameters["vertex_texcoords"] = np.stack([x + 0.3 * y, y - 0.2 * x], axis=-1).ravel()
    n = np.arange(81).reshape(9, 9)
    a, b, c, d = n[:-1, :-1], n[:-1, 1:], n[1:, 1:], n[1:, :-1]
    parameters["faces"] = np.stack([a, b, c, a, c, d], axis=-1).ravel()
    parameters.update()
    mesh.recompute_vertex_normals()
    file = directory / "wave.ply"
    mesh.write_ply(str(file))

    angle = np.linspace(0.0, 1.2, 16)
    turned = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    turned = np.broadcast_to(turned, (4, 16, 3)).astype(np.float32)
    chequers = np.full((4, 4, 3), 0.1, np.float32)
    chequers[::2, ::2] = [0.5, 0.2, 0.1]
    # what the shaders draw
    skin = {"type": "diffraction", "filename": str(table_file), "model": "kirchhoff"}
    transform = mi.ScalarTransform4f
    return {
        "type": "scene",
        "sensor": sensor(),
        "wave": {
            "type": "ply", "filename": str(file),
            "bsdf": {
                **skin, "energy_conserving": False, "height_scale": 1.2,
                "orientation": {
                    "type": "bitmap", "bitmap": mi.Bitmap(turned), "raw": True, "wrap_mode": "clamp"
                },
            },
        },
        "ball": {
            "type": "sphere", "center": [0, 0.3, 0.8], "radius": 0.8,
            "bsdf": {
                **skin, "material": "Au", "coat_ior": 1.4, "shadowing": "vcavity",
                "orientation": 40.0,
            },
        },
        "plate": {
            "type": "rectangle",
            "to_world": transform().translate([1.7, 0, 0]).rotate([1, 0, 0], 200).scale(0.8),
            "bsdf": {
                "type": "twosided",
                "bsdf": {
                    **skin,
                    "nested": {
                        "type": "diffuse",
                        "reflectance": {
                            "type": "bitmap", "bitmap": mi.Bitmap(chequers), "raw": False,
                            "to_uv": mi.ScalarTransform4f().scale([2, 1, 1]),
                        },
                    },
                },
            },
        },
        "coin": {
            "type": "disk",
            "to_world": transform().translate([0, -1.7, 0.1]).rotate([0, 1, 0], 15).scale(0.7),
            "bsdf": {
                **skin, "int_ior": 1.8,
                "nested": {"type": "diffuse", "reflectance": 0.3},
            },
        },
        "sun": {"type": "directional", "direction": [0.3, -1.0, -0.9], "irradiance": 3.0},
        "lamp": {"type": "point", "position": [3.0, -4.0, 5.0], "intensity": 40.0},
    }  # fmt: skip


def path_traced(scene: Any, spp: int, seed: int) -> NDArray[np.float64]:
    return np.array(mi.render(scene, spp=spp, seed=seed), np.float64)[..., :3]


@pytest.fixture
def renderer(gl: Any, some_variant: str, table_file: Path, tmp_path: Path) -> Any:
    scene = mi.load_dict(several_surfaces(table_file, tmp_path))
    made = Renderer(scene, context=gl)
    yield made
    made.release()


def test_pictures_agree_with_path_traced_ones(renderer: Any) -> None:
    scene = direct_light(renderer.packed.mitsuba_scene, renderer.camera)
    halves = [path_traced(scene, 256, seed) for seed in (1, 2)]
    reference = 0.5 * (halves[0] + halves[1])
    noise = 0.5 * np.nanmean(delta_e(*halves))
    # the lights are small and sharp here: samples of a pixel, edges of shadows
    for method, frames, mean in (("fast", 128, 0.7), ("exact", 32, 1.0)):
        light = renderer.progressive(method)
        light.advance(frames)
        drawn = light.image
        light.release()
        inside = binary_erosion(drawn[..., 3] > 0.999)
        assert inside.sum() > 500
        errors = delta_e(reference, drawn[..., :3])
        assert np.nanmean(errors[inside]) < mean + noise, method
        bias = drawn[inside, :3].sum() / reference[inside].sum()
        assert bias == pytest.approx(1.0, abs=0.03), method


def test_all_that_is_not_shown_is_named_in_warnings(
    gl: Any, some_variant: str, table_file: Path
) -> None:
    # what the shaders draw
    skin = {"type": "diffraction", "filename": str(table_file), "model": "kirchhoff"}
    scene = mi.load_dict(
        {
            "type": "scene",
            "sensor": {**sensor(), "type": "thinlens", "aperture_radius": 0.1, "focus_distance": 5},
            "plate": {"type": "rectangle", "bsdf": skin},
            "hair": {
                "type": "sdfgrid", "grid": mi.TensorXf(np.linspace(-1, 1, 8).reshape(2, 2, 2, 1)),
                "bsdf": {"type": "diffuse"},
            },
            "glass": {"type": "sphere", "bsdf": {"type": "dielectric"}},
            "torch": {"type": "spot"},
            "sun": {"type": "directional", "direction": [0, 0, -1]},
            "room": {"type": "constant", "radiance": 0.25},
        }
    )  # fmt: skip
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", DiffractionWarning)
        made = Renderer(scene, context=gl)
        for _ in range(2):
            made.render("fast", supersampling=1)
    # what no picture shows, and what progressive light does; each once
    never, single = [str(w.message) for w in caught if "realtime" in str(w.message)]
    for text, part in (
        (single, "the lens"), (never, "hair (SDFGrid)"), (never, "the material of glass"),
        (single, "torch (SpotLight)"),
    ):  # fmt: skip
        assert part in text
    np.testing.assert_allclose(made.sky[0], 0.25, rtol=0.02)  # its sampling
    assert np.abs(made.sky[1:]).max() < 0.02
    assert len(made.lights) == 1
    made.release()


def test_a_sky_over_one_half_lights_what_faces_it(
    gl: Any, some_variant: str, table_file: Path
) -> None:
    half = np.zeros((32, 64, 3), np.float32)
    half[:16] = [0.2, 0.4, 1.0]  # around Mitsuba's y axis
    upright = mi.ScalarTransform4f().rotate([1, 0, 0], 90).rotate([0, 0, 1], 25)
    scene = mi.load_dict(
        {
            "type": "scene",
            "sensor": sensor(30, 20),
            "ball": {
                "type": "sphere", "radius": 1.2, "bsdf": {"type": "diffuse", "reflectance": 0.5}
            },
            "speck": {
                "type": "rectangle", "to_world": mi.ScalarTransform4f().scale(1e-3),
                "bsdf": {
                    "type": "diffraction", "filename": str(table_file), "energy_conserving": False
                },
            },
            "sky": {"type": "envmap", "bitmap": mi.Bitmap(half), "to_world": upright},
        }
    )  # fmt: skip
    made = Renderer(scene, context=gl)
    with pytest.warns(DiffractionWarning, match="shown as a smooth one"):
        drawn = made.render("fast", supersampling=2)
    traced = path_traced(direct_light(scene, made.camera), 1024, 1)
    ball = binary_erosion(drawn[..., 3] > 0.999, np.ones((3, 3)))
    assert ball.sum() > 60
    # half of what a plane gets that faces all of it times 1 + cosθ; a pixel's 1024 samples scatter
    # by 1 %
    error = np.abs(drawn[ball, :3] - traced[ball]) / traced.max()
    assert error.mean() < 0.01
    assert error.max() < 0.06
    assert traced[ball, 2].max() > 2.0 * traced[ball, 2].min()
    made.release()
