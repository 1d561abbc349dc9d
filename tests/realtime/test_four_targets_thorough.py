"""Path tracer, GLSL, page and Cycles show one table of surfaces alike, or refuse them.

All surfaces are arches in one scene: normals turn by ±50° across the grooves. A sun without a disc
lights them, whose light has no noise. Cycles draws orders at random, most of them away from a sun:
there a sky lights them, brighter on one side. Light is reflected once.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np
import pytest
from numpy.typing import NDArray

import docs.make.blender
import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.plugin.description import describe
from mitsuba_diffraction.realtime.glsl import Renderer
from mitsuba_diffraction.realtime.glsl.features import GLSL
from mitsuba_diffraction.realtime.web.export import make_page
from mitsuba_diffraction.scene import read_exr
from tests.support.blender import blender, result_of
from tests.support.pictures import picture
from tests.support.surfaces import SURFACES
from tests.support.variants import VARIANTS, use

pytestmark = pytest.mark.thorough

Array = NDArray[np.float64]

COLUMNS, APART, SIZE = 6, (1.3, 1.1), (156, 112)
#: Height of the camera over the arches, and its angle of view in degrees.
HIGH, ANGLE = 60.0, 7.9
#: Direction towards the sun, across the grooves, and its irradiance.
SUN, IRRADIANCE = (0.45, 0.0, 0.893), 3.0
#: Pixels along a side of the squares whose means are compared, which have less noise.
BLOCK = 2
#: Samples of the path tracer and of Cycles, frames of GLSL and samples of the page.
SAMPLES, CYCLES, FRAMES, PAGE = 256, 1024, 64, 64
#: Blocks across an arch whose colours are averaged under the sky, which is smooth: its half.
SMOOTH = 4


class Halves(NamedTuple):
    """Two pictures of half of the samples each, means of blocks, (rows, columns, 3)."""

    first: Array
    second: Array

    @property
    def mean(self) -> Array:
        return 0.5 * (self.first + self.second)


class Stage(NamedTuple):
    """Arches that a target shows at least, and their picture by the path tracer."""

    bsdfs: dict[str, Any]
    places: dict[str, tuple[float, float, float]]
    mesh: Path
    traced: Halves

    def scene(self, shown: Iterable[str], light: dict[str, Any] | None = None) -> Any:
        """The scene under a light, by default the sun; surfaces that are not shown are black."""
        black = {"type": "diffuse", "reflectance": 0.0}
        known = set(shown)
        bsdfs = {n: bsdf if n in known else black for n, bsdf in self.bsdfs.items()}
        return mi.load_dict(scene_of(bsdfs, self.places, self.mesh) | (light or sun()))


def arch() -> tuple[Array, Array, Array, NDArray[np.int64]]:
    """Positions, normals and texture coordinates of the vertices of an arch, and its triangles."""
    turn = np.radians(np.linspace(-50.0, 50.0, 33))
    radius = 0.5 / np.sin(turn[-1])
    x, z = radius * np.sin(turn), radius * (np.cos(turn) - np.cos(turn[0]))
    rows = [np.stack([x, 0.0 * x + y, z], axis=1) for y in (-0.4, 0.4)]
    normals = np.tile(np.stack([np.sin(turn), 0.0 * x, np.cos(turn)], axis=1), (2, 1))
    along = np.linspace(0.0, 1.0, len(turn))
    uv = [np.stack([along, 0.0 * along + v], axis=1) for v in (0.0, 1.0)]
    a = np.arange(len(turn) - 1)
    b, c, d = a + 1, a + 1 + len(turn), a + len(turn)
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return np.concatenate(rows), normals, np.concatenate(uv), faces


def write_mesh(file: Path, positions: Array, normals: Array, uv: Array, faces: Any) -> str:
    """Write a mesh with vertices (..., 3) and triangles (n, 3); its file."""
    mesh = mi.Mesh(file.stem, positions.size // 3, len(faces), has_vertex_normals=True,
                   has_vertex_texcoords=True)  # fmt: skip
    parameters = mi.traverse(mesh)
    for key, values in (("positions", positions), ("normals", normals), ("texcoords", uv)):
        parameters[f"vertex_{key}"] = values.astype(np.float32).ravel()
    parameters["faces"] = faces.astype(np.uint32).ravel()
    parameters.update()
    mesh.write_ply(str(file))
    return str(file)


def scene_of(bsdfs: dict[str, Any], places: dict[str, Any], mesh: Path) -> dict[str, Any]:
    T = mi.ScalarTransform4f
    film = {
        "type": "hdrfilm", "width": SIZE[0], "height": SIZE[1], "rfilter": {"type": "box"},
        "pixel_format": "rgb", "component_format": "float32",
    }  # fmt: skip
    view = T().look_at([0.0, 0.0, HIGH], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    arches = {
        f"arch {n}": {
            "type": "ply", "filename": str(mesh), "bsdf": bsdf,
            "to_world": T().translate(list(places[name])),
        }
        for n, (name, bsdf) in enumerate(bsdfs.items())
    }  # fmt: skip
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "sensor": {"type": "perspective", "fov": ANGLE, "to_world": view, "film": film},
        **arches,
    }  # fmt: skip


def sun() -> dict[str, Any]:
    irradiance = {"type": "rgb", "value": IRRADIANCE}
    direction = [-x for x in SUN]
    return {"sun": {"type": "directional", "direction": direction, "irradiance": irradiance}}


def sky(file: Path) -> dict[str, Any]:
    """A sky of radiance 1 + x as a picture for Blender, whose rows begin at the zenith."""
    rows = 64
    elevation = np.pi * (0.5 - (np.arange(rows) + 0.5) / rows)[:, None]
    azimuth = np.pi - np.pi / rows * (np.arange(2 * rows) + 0.5)
    radiance = np.repeat((1.0 + np.cos(elevation) * np.cos(azimuth))[..., None], 3, axis=-1)
    picture = mi.Bitmap(radiance.astype(np.float32))
    picture.write(str(file))
    # Mitsuba's y is up, and its columns begin at −z
    upright = mi.ScalarTransform4f().rotate([0, 0, 1], 90).rotate([1, 0, 0], 90)
    return {"sky": {"type": "envmap", "bitmap": picture, "to_world": upright}}


def blocks(image: Any) -> Array:
    rows, columns = (n // BLOCK for n in np.shape(image)[:2])
    whole = np.asarray(image, np.float64)[: rows * BLOCK, : columns * BLOCK, :3]
    return whole.reshape(rows, BLOCK, columns, BLOCK, 3).mean(axis=(1, 3))


def refusal(bsdf: Any) -> str | None:
    """Why GLSL and the page cannot show a surface; all that Cycles shows, they do."""
    described = describe(bsdf)
    assert described is not None
    return GLSL.refusal(described)


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Stage:
    use(*VARIANTS)
    folder = tmp_path_factory.mktemp("arches")
    loaded = {name: mi.load_dict(make(folder)) for name, make in SURFACES.items()}
    bsdfs = {n: b for n, b in loaded.items() if refusal(b) is None}
    rows = -(-len(bsdfs) // COLUMNS)
    places = {
        name: (
            (n % COLUMNS - 0.5 * (COLUMNS - 1)) * APART[0],
            (n // COLUMNS - 0.5 * (rows - 1)) * APART[1],
            0.0,
        )
        for n, name in enumerate(bsdfs)
    }
    mesh = Path(write_mesh(folder / "arch.ply", *arch()))
    made = Stage(bsdfs, places, mesh, Halves(np.zeros(0), np.zeros(0)))
    return made._replace(traced=traced(made.scene(bsdfs), SAMPLES))


def traced(scene: Any, spp: int) -> Halves:
    return Halves(*(blocks(mi.render(scene, spp=spp // 2, seed=seed)) for seed in (1, 2)))


def profile(part: Array, joined: int) -> Array:
    along = part.mean(axis=0)
    whole = along[: len(along) // joined * joined]
    return np.asarray(whole.reshape(-1, joined, 3).mean(axis=1))


def errors(stage: Stage, found: Halves, names: Iterable[str], joined: int) -> dict[str, float]:
    """Mean ΔE2000 of each surface beyond the noise of both pictures, which adds in squares.

    Colours are means along the arch's lines of equal normals, and over `joined` blocks across them.
    """
    rows, columns, _ = found.first.shape
    half = HIGH * np.tan(np.radians(0.5 * ANGLE))
    x = (np.arange(columns) + 0.5 - 0.5 * columns) * (2.0 * half / columns)
    y = (0.5 * rows - np.arange(rows) - 0.5) * (2.0 * half / columns)
    beyond = {}
    for name in names:
        place = stage.places[name]
        inside = [
            np.flatnonzero(np.abs(y - place[1]) < 0.34),
            np.flatnonzero(np.abs(x - place[0]) < 0.44),
        ]
        traced, seen = (
            Halves(*(profile(half[np.ix_(*inside)], joined) for half in part))
            for part in (stage.traced, found)
        )
        exposure = 1.0 / float(np.percentile(traced.mean.mean(axis=-1), 95.0))

        def mean(one: Array, other: Array, exposure: float = exposure) -> float:
            return float(np.mean(delta_e(one, other, exposure=exposure, least=0.0)))

        # the mean of two halves has half the noise of their difference
        noise = 0.5 * np.hypot(mean(*traced), mean(*seen))
        beyond[name] = float(np.sqrt(max(mean(traced.mean, seen.mean) ** 2 - noise**2, 0.0)))
    return beyond


def check(stage: Stage, found: Halves, names: list[str], least: int, joined: int = 1) -> None:
    assert len(names) >= least
    beyond = errors(stage, found, names, joined)
    assert {name: round(error, 2) for name, error in beyond.items() if error > 1.0} == {}


def test_glsl_shows_them_as_the_path_tracer_does(gl: Any, stage: Stage) -> None:
    names = list(stage.bsdfs)
    made = Renderer(stage.scene(names), context=gl)
    light = made.progressive("fast")
    light.advance(FRAMES // 2)
    first = blocks(light.image)
    light.advance(FRAMES // 2)
    found = Halves(first, 2.0 * blocks(light.image) - first)
    light.release()
    made.release()
    check(stage, found, names, 30)


def test_the_page_shows_them_as_the_path_tracer_does(
    tab: Any, stage: Stage, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mitsuba_diffraction.realtime.web.export.OCTAVES", (-1.0, 0.0))
    names = list(stage.bsdfs)
    file = tmp_path / "arches.html"
    page = make_page(stage.scene(names), methods=["fast"], bounces=False)
    file.write_text(page.text, encoding="utf-8")
    opened = tab(SIZE)
    assert opened.open(file) == "ready"
    first, whole = (
        blocks(picture(opened, shadows=True, samples=count)) for count in (PAGE // 2, PAGE)
    )
    assert opened.said == []
    check(stage, Halves(first, 2.0 * whole - first), names, 30)


_CODE = """
import sys
import bpy
sys.path.append(beside)
import inside
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.wm.set_working_color_space(working_space="Linear Rec.2020")
scene = inside.settings(samples, 0, *size)
cycles = scene.cycles
cycles.max_bounces = cycles.glossy_bounces = cycles.diffuse_bounces = 0
scene.render.threads_mode, scene.render.threads = "FIXED", 2
for place, surface in arches:
    mesh = bpy.data.meshes.new("arch")
    mesh.from_pydata(positions, [], faces)
    layer = mesh.uv_layers.new()
    for loop in mesh.loops:
        layer.data[loop.index].uv = uv[loop.vertex_index]
    mesh.normals_split_custom_set_from_vertices(normals)
    mesh.materials.append(inside.material(surface))
    thing = bpy.data.objects.new("arch", mesh)
    thing.location = place
    bpy.context.collection.objects.link(thing)
inside.lights(scene, {"file": sky})
scene.camera = inside.camera(**camera)
settings = scene.render.image_settings
settings.file_format, settings.color_depth = "OPEN_EXR", "32"
settings.color_management = "OVERRIDE"
settings.linear_colorspace_settings.name = "Linear Rec.709"
result = []
for seed in (1, 2):
    cycles.seed = seed
    scene.render.filepath = f"{folder}/cycles_{seed}.exr"
    bpy.ops.render.render(write_still=True)
    result.append(scene.render.filepath)
"""


def test_cycles_shows_them_as_the_path_tracer_does(stage: Stage, tmp_path: Path) -> None:
    blender()
    light = sky(tmp_path / "sky.exr")
    arches, names = [], []
    for n, (name, bsdf) in enumerate(stage.bsdfs.items()):
        surface: dict[str, Any] = {"grey": 0.0}
        try:
            md.osl.export(bsdf, tmp_path / str(n), f"surface_{n}")
        except DiffractionError as error:
            assert "; " in str(error)  # with a way out
        else:
            surface = {"folder": str(tmp_path / str(n)), "tangent": "uv", "inputs": {}}
            names.append(name)
        arches.append((stage.places[name], surface))
    positions, normals, uv, faces = (part.tolist() for part in arch())
    files = result_of(
        _CODE, tmp_path, folder=str(tmp_path), beside=str(Path(docs.make.blender.__path__[0])),
        samples=CYCLES // 2, size=SIZE, arches=arches, positions=positions, normals=normals,
        uv=uv, faces=faces, sky=str(tmp_path / "sky.exr"),
        camera={"position": (0.0, 0.0, HIGH), "target": (0.0, 0.0, 0.0), "angle": ANGLE},
    )  # fmt: skip
    found = Halves(*(blocks(read_exr(Path(file))) for file in files))
    under_sky = stage._replace(traced=traced(stage.scene(names, light), SAMPLES))
    check(under_sky, found, names, 22, SMOOTH)


@pytest.mark.usefixtures("some_variant")
def test_what_no_target_shows_is_refused_with_the_reason(tmp_path: Path) -> None:
    """By features of the one list, in one sentence."""
    names = "film", "stack", "interface", "sheet", "solved sheet", "crossed", "speckle of places"
    for name in (*names, "lower by a texture", "film by a texture"):
        bsdf = mi.load_dict(SURFACES[name](tmp_path))
        with pytest.raises(DiffractionError) as refused:
            md.osl.export(bsdf, tmp_path / "osl")
        for sentence in (refusal(bsdf), str(refused.value)):
            assert sentence is not None, name
            assert " cannot show" in sentence
            assert "\n" not in sentence
