"""Labels: a logo is read on card and meshes as the same picture put on as a diffuse texture."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene import label
from mitsuba_diffraction.scene.load import load_scene
from mitsuba_diffraction.scene.logo import areas, wavelengths_of
from mitsuba_diffraction.scene.orientation.mesh_files import load_mesh
from tests.support.logos import drawn, write_board
from tests.support.meshes import obj_of

pytestmark = [
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
    pytest.mark.usefixtures("coarse"),
]
_ASPECT = 4 / 3


@pytest.fixture
def parts(tmp_path: Path) -> Any:
    mi.set_variant("llvm_ad_rgb")
    drawn(128, 4).save(tmp_path / "logo.png")
    return areas(tmp_path / "logo.png", dots=128)


def hits(scene: Any, shape: Any) -> Any:
    """Points of a shape seen from −y, on a grid of 48 × 36 places over its box; row 0 on top."""
    low, high = (np.ravel(side) for side in (shape.bbox().min, shape.bbox().max))
    x, z = np.meshgrid((np.arange(48) + 0.5) / 48, 1 - (np.arange(36) + 0.5) / 36)
    x, z = (low[k] + (high[k] - low[k]) * part.ravel() for k, part in ((0, x), (2, z)))
    origin = mi.Point3f(mi.Float(x), float(low[1]) - 1.0, mi.Float(z))
    found = scene.ray_intersect(mi.Ray3f(origin, mi.Vector3f(0, 1, 0)))
    assert np.all(found.is_valid())
    dr.eval(found)  # the scene may end before it is asked
    return found


def looked_up(data: Any, found: Any, to_uv: Any = None) -> np.ndarray:
    """Values (36, 48) of a picture at points, by Mitsuba's bitmap."""
    placed = {} if to_uv is None else {"to_uv": mi.ScalarTransform4f(to_uv)}
    texture = mi.load_dict({
        "type": "bitmap", "raw": True, "filter_type": "nearest", "wrap_mode": "clamp",
        "data": mi.TensorXf(data), **placed,
    })  # fmt: skip
    return np.array(texture.eval_1(found)).reshape(36, 48)


def shown(folder: Path, gentle: dict[str, str]) -> tuple[Any, np.ndarray]:
    """Hits of a written scene, and wavelengths there, nm; 0 without a grating."""
    scene = load_scene(folder / "label.xml", {**gentle, "resx": "8", "resy": "6"})
    (shape,) = (each for each in scene.shapes() if "DiffractionMix" in str(each.bsdf()))
    text = (folder / "label.xml").read_text().split('name="to_uv" value="')[1].split('"')[0]
    with Image.open(folder / "label_weight.png") as picture:
        weight = np.asarray(picture, np.float32)[..., None]
    scale = np.array(mi.Bitmap(str(folder / "label_lateral_scale.exr")), np.float32)
    found = hits(scene, shape)
    data = np.where(weight > 0, scale.reshape(weight.shape), 0.0)
    stretch = looked_up(data, found, np.array(text.split(), float).reshape(4, 4))
    return found, stretch * label.PERIOD * label.TANGENTIAL * 1e3


def colours(parts: Any) -> np.ndarray:
    """Wavelengths of the logo's colours (ny, nx, 1), nm."""
    each = np.array([0.0, *(wavelengths_of(colour)[0] for colour in parts.colours)])
    return np.asarray(each[parts.labels][..., None], np.float32)


def check(wavelengths: np.ndarray, truth: np.ndarray) -> None:
    """The picture is seen, and not one of its mirror images."""
    same, *mirrored = (
        np.mean(np.abs(wavelengths - other) < 2.0)  # halves of single precision
        for other in (truth, truth[::-1], truth[:, ::-1], truth[::-1, ::-1])
    )
    # nearest texels of 128 dots at 48 places: places beside an edge may differ
    assert same > 0.98
    assert max(mirrored) < 0.96  # the letter alone tells which side is up


def test_on_a_card_it_is_the_picture(tmp_path: Path, parts: Any, gentle: dict[str, str]) -> None:
    label.write(tmp_path, parts, label.card(_ASPECT), None)
    _, seen = shown(tmp_path, gentle)
    rows, columns = ((2 * np.arange(n) + 1) * side // (2 * n) for n, side in ((36, 96), (48, 128)))
    check(seen, colours(parts)[rows][:, columns, 0])


@pytest.mark.parametrize(
    ("name", "turn"), [("board.obj", 0), ("board.obj", 1), ("board.ply", 3), ("board.glb", 0)]
)
def test_on_a_mesh_it_is_as_a_diffuse_texture_on_an_obj(
    tmp_path: Path, parts: Any, gentle: dict[str, str], name: str, turn: int
) -> None:
    # Mitsuba's own reader puts a picture onto an OBJ upright
    write_board(tmp_path / "plain.obj")
    plain = mi.load_dict(
        {"type": "scene", "board": {"type": "obj", "filename": str(tmp_path / "plain.obj")}}
    )
    truth = looked_up(colours(parts), hits(plain, plain.shapes()[0]))
    mesh = tmp_path / "in" / name
    mesh.parent.mkdir()
    write_board(mesh, turn)
    place = label.front(mesh, _ASPECT, width=1.0, height=0.5, up="z")
    label.write(tmp_path / "out", parts, place, mesh, up="z")
    found, seen = shown(tmp_path / "out", gentle)
    check(seen, truth)
    # light is spread upwards
    assert place.elevations == pytest.approx(0.0, abs=1e-3)
    upwards = np.pi / 2 - np.arctan2(place.matrix[1, 0], place.matrix[0, 0])
    first = np.array(found.dp_du)[:, 0]
    first = first / np.linalg.norm(first)
    second = np.cross(np.array(found.n)[:, 0], first)
    assert np.cos(upwards) * first + np.sin(upwards) * second == pytest.approx(
        [0.0, 0.0, 1.0], abs=1e-4
    )


def write_can(file: Path, seam: float) -> None:
    """Write a cylinder, z up; its texture coordinates begin at this azimuth, degrees from −y."""
    around = np.radians(seam - 90.0) + np.linspace(0, 2 * np.pi, 49)
    places = [(3 * np.cos(a), 3 * np.sin(a), z) for z in (0, 6) for a in around]
    uv = [(u, v) for v in (0, 1) for u in np.linspace(0, 1, 49)]
    obj_of(file, places, [(k, k + 1, k + 50, k + 49) for k in range(48)], uv)


@pytest.mark.parametrize("seam", [0.0, 20.0, -20.0])
def test_a_label_that_a_seam_cuts_is_refused_with_a_turn_that_serves(
    tmp_path: Path, seam: float
) -> None:
    mi.set_variant("llvm_ad_rgb")
    can = tmp_path / "can.obj"
    write_can(can, seam)
    options: Any = {"width": 0.6, "height": 0.5, "up": "z"}  # which covers ±37° of azimuth
    with pytest.raises(DiffractionError, match="seam of its texture coordinates") as refused:
        label.front(can, _ASPECT, **options)
    turn = float(str(refused.value).split("turn=")[1].split(",")[0])
    assert abs(turn) < 90
    assert not label.front(can, _ASPECT, turn=turn, **options).cut
    write_can(can, 60.0)
    assert not label.front(can, _ASPECT, **options).cut


@pytest.mark.parametrize("elevation", [-8.0, 0.0, 20.0])
def test_the_ring_stands_where_its_first_order_reaches_the_camera(elevation: float) -> None:
    elevations = elevation + np.linspace(-3, 3, 5)
    ring, tangential = label.geometry(elevations)
    sines = [np.sin(np.radians(angle - elevations)) for angle in (8.0, ring)]
    assert tangential == pytest.approx(sines[0] + sines[1])


def test_files_that_a_mesh_names_are_copied_with_it(tmp_path: Path, parts: Any) -> None:
    (tmp_path / "meshes").mkdir()
    write_board(mesh := tmp_path / "meshes" / "board.gltf")
    label.write(tmp_path / "made", parts, label.card(_ASPECT), mesh)
    copy = load_mesh(tmp_path / "made" / "board.gltf")
    np.testing.assert_array_equal(copy.positions, load_mesh(mesh).positions)


def test_a_mesh_may_have_any_name(tmp_path: Path, parts: Any, gentle: dict[str, str]) -> None:
    write_board(mesh := tmp_path / "größe & $up.obj")
    scene = label.write(tmp_path / "made", parts, label.card(_ASPECT), mesh)
    assert load_scene(scene, gentle).shapes()
