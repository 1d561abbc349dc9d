"""Light that is accumulated: its mean is all direct light, its shadows are soft and clean."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter, minimum_filter

from mitsuba_diffraction.realtime.glsl.camera import Camera
from mitsuba_diffraction.realtime.glsl.renderer import Renderer
from mitsuba_diffraction.realtime.shader_comparison.path_traced import (
    box_sensor,
    direct_light,
)

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore:the realtime picture does not show"),
]


def diffuse(value: float = 0.5) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": value}}


def rectangle(at: Any, bsdf: Any = None) -> dict[str, Any]:
    """A square from −1 to 1, transformed, by default of grey."""
    return {"type": "rectangle", "to_world": at, "bsdf": bsdf or diffuse()}


def plate_scene(table_file: Path, width: int = 160, **parts: Any) -> Any:
    """A plate at z = 0 seen from above, with something out of sight that diffracts."""
    T = mi.ScalarTransform4f
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective",
                "fov": 30,
                "to_world": T().look_at([0, -8, 1.5], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": width, "height": width // 4},
            },
            "plate": rectangle(T().scale(4.0)),
            "skin": rectangle(
                T().translate([0, 8, -0.5]).scale(0.1),
                {"type": "diffraction", "filename": str(table_file)},
            ),
            **parts,
        }
    )


@contextmanager
def drawn(
    gl: Any, scene: Any, frames: int, size: tuple[int, int] | None = None
) -> Iterator[tuple[Renderer, NDArray[np.float64]]]:
    """The renderer of a scene, and its picture after so many frames, (height, width, 3)."""
    renderer = Renderer(scene, context=gl)
    light = renderer.progressive(size=size)
    light.advance(frames)
    image = light.image[..., :3].astype(float)
    light.release()
    yield renderer, image
    renderer.release()


def truth(renderer: Renderer, spp: int, size: tuple[int, int] | None = None) -> NDArray[np.float64]:
    """Direct light by the path tracer, a pixel the mean over its square."""
    camera = renderer.camera.resized(*size) if size else renderer.camera
    sensor, integrator = box_sensor(camera), mi.load_dict({"type": "direct"})
    image = mi.render(renderer.packed.mitsuba_scene, sensor=sensor, integrator=integrator, spp=spp)
    return np.array(image, np.float64)


def shapes_seen(scene: Any, camera: Camera) -> NDArray[np.int64]:
    """Number of the shape of each pixel (height, width), −1 for the background and −2 at edges."""
    index = mi.load_dict({"type": "aov", "aovs": "shape:shape_index"})
    seen = np.array(mi.render(scene, sensor=box_sensor(camera), integrator=index, spp=16))[..., 0]
    depth = mi.render(scene, sensor=box_sensor(camera), integrator=mi.load_dict({"type": "depth"}))
    shapes = np.where(np.array(depth)[..., 0] > 0.0, seen, -1.0)
    same = (maximum_filter(shapes, 3) - minimum_filter(shapes, 3)) < 1e-3
    return np.where(same, np.rint(shapes), -2).astype(int)


def test_the_penumbra_of_a_disc_is_that_of_the_path_tracer(
    gl: Any, some_variant: str, table_file: Path
) -> None:
    T = mi.ScalarTransform4f
    scene = plate_scene(
        table_file,
        lamp={
            "type": "disk",
            "to_world": T().translate([0, 0, 6]).rotate([1, 0, 0], 180).scale(0.5),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 40.0}},
        },
        # from x = −5 to 0, out of the camera's sight
        screen=rectangle(T().translate([-5, 0, 2]).scale([5, 3, 1]), diffuse(0.0)),
    )
    # every other frame draws a light
    with drawn(gl, scene, 512, (192, 4)) as (renderer, image):
        row, expected = (part[2, :, 1] for part in (image, truth(renderer, 4096, (192, 4))))
    assert (expected < 0.02 * expected.max()).sum() > 20
    assert ((expected > 0.1 * expected.max()) & (expected < 0.9 * expected.max())).sum() > 10
    assert np.abs(row - expected).max() < 0.02 * expected.max()


@pytest.mark.parametrize(
    "light",
    [
        {"type": "directional", "direction": [1.0, 0.4, -0.3], "irradiance": 3.0},  # 16° high
        {"type": "directional", "direction": [0.1, 0.4, -1.0], "irradiance": 3.0},
        {"type": "point", "position": [-2.0, -1.5, 1.2], "intensity": 10.0},
        {"type": "spot", "intensity": 60.0, "cutoff_angle": 40, "beam_width": 20},
    ],
    ids=["low", "high", "near", "spot"],
)
def test_shadows_have_neither_acne_nor_leaks(
    gl: Any, some_variant: str, table_file: Path, light: dict[str, Any]
) -> None:
    """A log, which is open, a thin wall and a box over a plate, as the path tracer has them."""
    T = mi.ScalarTransform4f
    box = T().translate([-1.6, -0.4, 0.4]).rotate([0, 0, 1], 30).rotate([1, 0, 0], 20).scale(0.25)
    if light["type"] == "spot":
        light = {**light, "to_world": T().look_at([-3, -2, 3], [0, 0, 0], [0, 0, 1])}
    scene = plate_scene(
        table_file,
        lamp=light,
        log={
            "type": "cylinder",
            "radius": 0.4,
            "p0": [0.5, 0.3, 0.4],
            "p1": [1.3, -0.3, 0.4],
            "bsdf": {"type": "twosided", "bsdf": diffuse()},
        },
        wall=rectangle(
            T().translate([-0.6, 0.3, 0.5]).rotate([1, 0, 0], 90).scale([0.6, 0.5, 1]),
            {"type": "twosided", "bsdf": diffuse()},
        ),
        box={"type": "cube", "to_world": box, "bsdf": diffuse()},
    )
    with drawn(gl, scene, 16, (160, 40)) as (renderer, image):
        found, expected = image[..., 1], truth(renderer, 64)[..., 1]
    low, high = minimum_filter(expected, 5), maximum_filter(expected, 5)
    inside = high - low < 0.1 * expected.max()  # neither an edge, nor beside one
    lit, dark = inside & (expected > 0.05 * expected.max()), inside & (expected == 0.0)
    assert lit.sum() > 1000
    assert dark.sum() > 50
    # samples of a pixel: 16 here, 64 there
    assert np.abs(found - expected)[lit].max() < 0.05 * expected.max()
    # where light grazes the log's thin wall, a texel holds both of its sides; there it is dim
    assert found[dark].max() < 0.03 * expected.max()
    assert (found[dark] > 1e-3 * expected.max()).mean() < 0.05


def test_light_outside_a_room_stays_outside(gl: Any, some_variant: str, table_file: Path) -> None:
    """The camera and a lamp are within a cube, the sun beyond it."""
    sun = {"type": "directional", "direction": [0.3, 0.4, -1.0], "irradiance": 50.0}
    lamp = {"type": "point", "position": [0.5, -2.0, 2.0], "intensity": 3.0}
    for emitter, lit in ((sun, 0.0), (lamp, 1.0)):
        wide = mi.ScalarTransform4f().scale(20.0)
        walls = {"type": "twosided", "bsdf": diffuse()}
        room = {"type": "cube", "to_world": wide, "bsdf": walls}
        scene = plate_scene(table_file, width=40, emitter=emitter, room=room)
        with drawn(gl, scene, 4) as (renderer, image):
            found, expected = (part[..., 1].mean() for part in (image, truth(renderer, 256)))
        assert found == pytest.approx(expected, rel=0.05)
        assert (found > 0.0) == (lit > 0.0)


@pytest.mark.parametrize("high", [0.15, 1.0], ids=["low", "high"])
def test_steep_bumps_shade_themselves_as_in_the_path_tracer(
    gl: Any, some_variant: str, table_file: Path, high: float
) -> None:
    """Without the facets' shadows, low light is half as bright again."""
    bumps = np.random.default_rng(1).uniform(0.0, 0.4, (32, 32, 1)).astype(np.float32)
    bumpy = {
        "type": "bumpmap",
        "texture": {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(bumps)},
        "bsdf": diffuse(),
    }
    scene = plate_scene(
        table_file,
        plate=rectangle(mi.ScalarTransform4f().scale(4.0), bumpy),
        lamp={"type": "directional", "direction": [1.0, 0.4, -high], "irradiance": 3.0},
    )
    with drawn(gl, scene, 16, (320, 80)) as (renderer, image):
        found, expected = image[..., 1].mean(), truth(renderer, 64)[..., 1].mean()
    assert found == pytest.approx(expected, rel=0.01)


def test_pigments_have_another_colour_in_each_light(
    gl: Any, some_variant: str, table_file: Path
) -> None:
    """Red in bluish light: three colours' products are off by a tenth."""
    if "spectral" not in some_variant:
        pytest.skip("without spectra there are three colours only")
    bluish = {"type": "irregular", "wavelengths": "380, 550, 720", "values": "3, 1.2, 0.6"}
    red = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.4, 0.03, 0.01]}}
    T = mi.ScalarTransform4f
    scene = plate_scene(
        table_file,
        lamp={"type": "directional", "direction": [0.3, 0.4, -1.0], "irradiance": bluish},
        other={"type": "point", "position": [0.0, 9.0, 0.5], "intensity": 3.0},
        plate=rectangle(T().scale(4.0), red),
        wall=rectangle(T().translate([0, 5, 0]).rotate([1, 0, 0], 90).scale(9.0), diffuse(0.0)),
    )
    with drawn(gl, scene, 256, (40, 10)) as (renderer, image):
        found, expected = image[5, 20], truth(renderer, 64)[15:25, 70:90].mean(axis=(0, 1))
    assert found[0] == pytest.approx(expected[0], rel=0.05)  # how often the light is drawn
    assert found / found[0] == pytest.approx(expected / expected[0], rel=0.02, abs=0.002)


def test_lobes_and_lights_share_what_surrounds_a_scene(
    gl: Any, some_variant: str, table_file: Path
) -> None:
    """Each material under an area light and an environment; the light itself is seen, too."""
    T = mi.ScalarTransform4f
    skin = {
        "type": "diffraction",
        "filename": str(table_file),
        "material": "Al",
        "orientation": 30.0,
    }
    bumps = np.tile(np.sin(np.linspace(0.0, 6.3, 16, endpoint=False)) * 0.02, (16, 1))
    materials = {
        "skin": skin,
        "coated": {**skin, "coat_ior": 1.4, "energy_conserving": False},
        "rough": {"type": "roughplastic", "alpha": 0.15, "diffuse_reflectance": 0.3},
        "metal": {"type": "roughconductor", "material": "Au", "alpha": 0.1, "distribution": "ggx"},
        "smooth": {"type": "plastic", "diffuse_reflectance": 0.2},
        "principled": {"type": "principled", "roughness": 0.45, "specular": 0.8,
                       "base_color": {"type": "rgb", "value": [0.1, 0.2, 0.4]}},
        "brass": {"type": "principled", "metallic": 0.7, "roughness": 0.4,
                  "base_color": {"type": "rgb", "value": [0.8, 0.6, 0.2]}},
        "bumpy": {
            "type": "bumpmap",
            "texture": {"type": "bitmap", "raw": True,
                        "bitmap": mi.Bitmap(bumps[..., None].astype(np.float32))},
            "bsdf": diffuse(),
        },
    }  # fmt: skip
    plates = {
        name: rectangle(
            T().translate([1.1 * (n % 4 - 1.5), 1.1 * (n // 4 - 0.5), 0]).scale(0.5), bsdf
        )
        for n, (name, bsdf) in enumerate(materials.items())
    }
    lamp = T().look_at([0, 2.5, 1.6], [0, 0, 0], [0, 0, 1]).scale(0.6)
    scene = mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective", "fov": 50,
                "to_world": T().look_at([0, -2.4, 2.4], [0, 0.5, 0.2], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 32, "height": 24},
            },
            "lamp": {
                "type": "disk", "to_world": lamp,
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [4.0, 3.0, 2.0]}},
            },
            "room": {"type": "constant", "radiance": {"type": "rgb", "value": 0.5}},
            **plates,
        }
    )  # fmt: skip
    with drawn(gl, scene, 768) as (renderer, found):
        once = direct_light(scene, renderer.camera)
        expected = np.array(mi.render(once, spp=512), float)[..., :3]
        shapes = shapes_seen(scene, renderer.camera)
    numbers = [number for number in np.unique(shapes) if number > -2]
    assert len(numbers) >= 1 + len(materials)
    for number in numbers:
        pixels = shapes == number
        mean = expected[pixels].mean(axis=0)
        # what glossy plates mirror of 384 lights is off by up to 3 %, by 2 % of half as many again
        assert found[pixels].mean(axis=0) == pytest.approx(mean, abs=0.04 * mean.max()), number


def test_a_mirror_on_a_wide_plate_sees_nothing_beneath_it(
    gl: Any, some_variant: str, table_file: Path
) -> None:
    """It sees the plate alone, which is not lit twice."""
    T = mi.ScalarTransform4f
    scene = plate_scene(
        table_file,
        plate=rectangle(T().scale(400.0)),
        room={"type": "constant", "radiance": {"type": "rgb", "value": 0.5}},
        mirror=rectangle(
            T().translate([0.0, 0.0, 0.25]).rotate([1, 0, 0], 90).scale([1, 0.25, 1]),
            {"type": "conductor", "material": "Au"},
        ),
    )
    with drawn(gl, scene, 8, (160, 40)) as (renderer, image):
        found, expected = image[..., 1], truth(renderer, 16)[..., 1]
    dark = expected == 0.0
    assert dark.sum() > 50
    assert found[dark].max() == 0.0


@pytest.mark.parametrize("shape", ["disk", "cube"])
def test_a_lamp_may_reflect_other_light(
    gl: Any, some_variant: str, table_file: Path, shape: str
) -> None:
    """A painted lamp under another one: seen, lit by it, and lighting the plate."""
    paint = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.7, 0.3, 0.1]}}
    glow = {"type": "area", "radiance": {"type": "rgb", "value": [0.1, 0.2, 0.5]}}
    above = mi.ScalarTransform4f().translate([0.0, 1.0, 0.6]).rotate([1, 0, 0], 60).scale(0.5)
    scene = plate_scene(
        table_file,
        width=48,
        lamp={"type": "point", "position": [0.5, -2.0, 4.0], "intensity": 20.0},
        painted={"type": shape, "to_world": above, "bsdf": paint, "emitter": glow},
    )
    with drawn(gl, scene, 512) as (renderer, found):
        expected, shapes = truth(renderer, 512), shapes_seen(scene, renderer.camera)
    numbers = np.unique(shapes[shapes >= 0])
    assert len(numbers) == 2
    for number in numbers:
        pixels = shapes == number
        mean = expected[pixels].mean(axis=0)
        assert found[pixels].mean(axis=0) == pytest.approx(mean, rel=0.02), number


def test_what_is_in_focus_stays_where_it_is(some_variant: str) -> None:
    view = np.array(mi.ScalarTransform4f().look_at([1, -4, 3], [0, 0, 0], [0, 0, 1]).matrix, float)
    camera = Camera(view, 40.0, (64, 48), lens=0.3, focus=3.0)
    near, far = camera.to_world @ [0.4, -0.2, 3.0, 1.0], camera.to_world @ [0.4, -0.2, 6.0, 1.0]
    apart = []
    for point in (near, far):
        clips = [
            through.view_projection(np.full(3, -9.0), np.full(3, 9.0)) @ point
            for through in (camera, camera.sampled(np.zeros(2), np.array([0.7, 0.2])))
        ]
        apart.append(np.abs(np.diff([clip[:2] / clip[3] for clip in clips], axis=0)).max())
    assert apart[0] < 1e-6  # Mitsuba's matrix is single
    assert apart[1] > 0.05
