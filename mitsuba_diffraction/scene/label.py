"""Scenes of a hologram made from a logo: on a card, or as a label on the front of a mesh."""

from __future__ import annotations

import math
import os
import shutil
import xml.etree.ElementTree as ElementTree
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
from PIL import Image

from ..arrays import Real
from ..atomic import atomic_path, make_folder
from ..errors import DiffractionError
from ..gltf import named_files
from ..plugin.presets import PATCHES
from .fitted_mesh import fitted_mesh
from .hologram import Files
from .logo import HUES, Areas, logo, wavelengths_of
from .orientation.mesh_files import load_mesh
from .stage import STUDIO

#: Length of the tangential part of ω_i + ω_o: periods of 1.0 to 1.4 µm are blue to red.
TANGENTIAL = 0.448
#: Period of the patch that the scene stretches, µm: `precompute/hologram.toml`.
PERIOD = 1.3
#: Files of a label's folder; the first words of the names of the textures.
STEM, AROUND, GRATING, RING, SCENE = (
    "label", "label_around.png", "grating.toml", "ring.xml", "label.xml",
)  # fmt: skip
# The scene's camera: elevation, degrees, distance and height of the point it looks at, cm; so far
# that colours change little over the label
_CAMERA, _FAR, _MIDDLE = 8.0, 400.0, 3.0
# The ring, which is 2° high: distance, cm, and elevations, degrees
_DISTANCE, _RING = 600.0, (6.0, 80.0)
# Half of the card's larger side, cm, and its part of the picture of 4 by 3
_CARD, _FILLED, _PICTURE = 3.0, 0.86, 4.0 / 3.0
# Heights at which a label's surface is looked at, and columns and rows where its coordinates are
_HEIGHTS = 33
_COLUMNS, _ROWS = 9, 3
# Turns that are tried for a label that a seam cuts, degrees
_TURNS = tuple(sign * turn for turn in range(15, 181, 15) for sign in (1, -1))
# Factors on the patch's period that the plugin's table serves well
_STRETCH = (0.4, 1.5)


class LabelPlace(NamedTuple):
    """Place of a label on a surface.

    Attributes
    ----------
    matrix : (2, 3), centimetres to the right and upwards from the label's middle, of (u, v, 1).
    size : (width, height), cm.
    elevations : of the surface's normal, degrees, evenly from the label's lower to its upper edge.
    cut : whether the texture coordinates leave the label within it, as at a seam.
    """

    matrix: Real
    size: tuple[float, float]
    elevations: Real
    cut: bool = False


def files_in(folder: Path) -> list[Path]:
    """List the files that a label has in its folder, beside a copy of its mesh."""
    return [
        *Files.called(folder, STEM),
        *(folder / name for name in (AROUND, GRATING, RING, SCENE)),
    ]


def card(aspect: float) -> LabelPlace:
    """Return the place of a picture, of this width over height, that fills an upright card."""
    width, height = 2 * _CARD * min(1.0, aspect), 2 * _CARD * min(1.0, 1.0 / aspect)
    matrix = np.array([[width, 0.0, -width / 2], [0.0, height, -height / 2]])
    return LabelPlace(matrix, (width, height), np.zeros(1))


def front(
    file: Path, aspect: float, *, width: float, height: float, up: str = "auto", turn: float = 0.0
) -> LabelPlace:
    """Return the place of a label on the front of a mesh, upright and not mirrored.

    The texture coordinates of the triangle in the label's middle are continued over the label.

    Parameters
    ----------
    file : mesh.
    aspect : width over height of the picture.
    width : of the label, as a share of the mesh's width.
    height : of the label's middle, as a share of the mesh's height.
    up, turn : axis that points upwards, and degrees around it, as in the scene.

    Raises a DiffractionError if the mesh has no texture coordinates, no area of them there, or a
    seam of them within the label, or if its normals point inwards there.
    """
    read = load_mesh(file)
    if read.uv is None:
        raise DiffractionError(
            f"mesh '{file}' has no texture coordinates, which a label needs; unwrap it, e.g. in "
            "Blender"
        )
    mesh = fitted_mesh(read, file, up=up)
    uv = read.uv[read.faces]  # before coordinates without area are replaced

    def place_at(turn: float) -> LabelPlace:
        sin, cos = math.sin(math.radians(turn)), math.cos(math.radians(turn))
        rotation = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
        corners = (mesh.positions @ rotation.T)[mesh.faces]
        sides = np.ptp(corners.reshape(-1, 3), axis=0)
        normals = (mesh.normals @ rotation.T)[mesh.faces]
        return _place(file, corners, normals, uv, width * sides[0], height * sides[2], aspect)

    def serves(turn: float) -> bool:
        try:
            return not place_at(turn).cut
        except DiffractionError:
            return False

    place = place_at(turn)
    if place.cut:
        whole = next((turn + step for step in _TURNS if serves(turn + step)), None)
        raise DiffractionError(
            f"mesh '{file}': a seam of its texture coordinates cuts the label; "
            + ("unwrap it again" if whole is None else f"choose turn={whole:g}")
            + ", or a smaller width"
        )
    return place


def _place(
    file: Path, corners: Real, normals: Real, uv: Real, wide: float, z: float, aspect: float
) -> LabelPlace:
    """Return the place of a label on the side that looks to −y.

    Raises a DiffractionError if that side's normals point away from −y, or its texture coordinates
    have no area in the label's middle.

    file : mesh, named in errors.
    corners, normals, uv : (m, 3, 3 or 2) of the triangles' corners.
    wide, z : width of the label and height of its middle, cm.
    """
    facing = normals.sum(axis=1)

    def normal_at(z: float) -> tuple[int, Real, Real]:
        number, weights, _ = _in_front(corners, 0.0, z, facing)
        normal = weights @ normals[number]
        return number, weights, normal / np.linalg.norm(normal)

    number, weights, normal = normal_at(z)
    if normal[1] > 0.0:
        raise DiffractionError(
            f"mesh '{file}': its normals point inwards at the label; turn them outwards, e.g. in "
            "Blender"
        )
    level = math.hypot(normal[0], normal[1])
    right, high = np.array([-normal[1], normal[0], 0.0]) / level, wide / aspect
    rise = level * high
    steep = [normal_at(z + part * rise)[2][2] for part in np.linspace(-0.5, 0.5, _HEIGHTS)]
    edges = corners[number, 1:] - corners[number, 0]
    flat = np.stack([edges @ right, edges @ np.cross(normal, right)])  # (2, 2), columns are edges
    steps = (uv[number, 1:] - uv[number, 0]).T
    if abs(np.linalg.det(steps)) < 1e-12:
        raise DiffractionError(
            f"mesh '{file}': its texture coordinates have no area in the label's middle; unwrap it "
            "again, or turn another side to the front"
        )
    linear = flat @ np.linalg.inv(steps)
    shift = -linear @ (weights @ uv[number])
    elevations = np.degrees(np.arcsin(np.clip(steep, -1.0, 1.0)))
    place = LabelPlace(np.column_stack([linear, shift]), (wide, high), elevations)
    for x in np.linspace(-0.5, 0.5, _COLUMNS):
        for y in np.linspace(-0.5, 0.5, _ROWS):
            number, weights, hit = _in_front(corners, x * wide, z + y * rise, facing)
            seen = place.matrix @ [*(weights @ uv[number]), 1.0]
            # a seam leads out of the label; a curved front moves its edge by less
            if hit and np.any(np.abs(seen / place.size - [x, y]) > 0.5):
                return place._replace(cut=True)
    return place


def _in_front(corners: Real, x: float, z: float, normals: Real) -> tuple[int, Real, bool]:
    """Return the triangle seen first from −y at this place, its barycentric weights, and True.

    Where no triangle is, it is the nearest one that faces −y, and False.
    """
    around = corners[..., [0, 2]] - [x, z]
    # twice the areas between the point and the sides opposite to the corners
    (a, b), (c, d) = (np.moveaxis(np.roll(around, -n, axis=1), -1, 0) for n in (1, 2))
    parts = a * d - b * c
    whole = parts.sum(axis=1, keepdims=True)
    weights = parts / np.where(whole == 0.0, np.nan, whole)
    hit = (weights >= -1e-9).all(axis=1)
    if hit.any():
        depth = np.where(hit, np.einsum("ij,ij->i", weights, corners[..., 1]), np.inf)
        number = int(depth.argmin())
        return number, weights[number], True
    away = np.linalg.norm(around.mean(axis=1), axis=1)
    number = int(np.where(normals[:, 1] < 0.0, away, np.inf).argmin())
    return number, np.full(3, 1.0 / 3.0), False


def geometry(elevations: Real) -> tuple[float, Real]:
    """Return the ring's elevation, degrees, and the tangential parts (n,) of ω_i + ω_o upwards.

    elevations : (n,) of the label's normal, degrees, from its lower to its upper edge; where they
        leave what the patch can be stretched to, colours are wrong.

    Raises a DiffractionError if no ring shows colours in the middle.
    """
    middle = float(elevations[len(elevations) // 2])
    wanted = TANGENTIAL - math.sin(math.radians(_CAMERA - middle))
    ring = middle + math.degrees(math.asin(float(np.clip(wanted, -1.0, 1.0))))
    ring = float(np.clip(ring, *_RING))
    tangential = np.sin(np.radians(_CAMERA - elevations)) + np.sin(np.radians(ring - elevations))
    low, high = HUES[1] * 1e-3 / PERIOD / _STRETCH[1], HUES[0] * 1e-3 / PERIOD / _STRETCH[0]
    if not low <= tangential[len(elevations) // 2] <= high:
        raise DiffractionError(
            f"the label's surface is inclined by {abs(middle):.0f}°, where no lamp shows its "
            "colours to the camera; choose another height, turn or up"
        )
    return ring, np.clip(tangential, low, high)


def write(folder: Path, parts: Areas, place: LabelPlace, mesh: Path | None, **values: str) -> Path:
    """Write textures, patch, light and scene into a folder; return the scene.

    Parameters
    ----------
    parts : areas of the picture.
    place : where the label lies.
    mesh : copied into the folder with the files that it names; None for a card.
    values : defaults of the scene's parameters.

    Raises a DiffractionError if the folder cannot be written to.
    """
    make_folder(folder)
    ring, tangential = geometry(place.elevations)
    linear = place.matrix[:, :2]
    # degrees from the first tangent, in the label's plane, to the label's upward direction
    orientation = 90.0 - math.degrees(math.atan2(linear[1, 0], linear[0, 0]))
    foil = logo(parts, tangential=tangential, orientation=orientation, period=PERIOD)
    names = foil.write(folder, STEM)
    around = np.full(foil.weight.shape, 255, np.uint8)
    around[1:-1, 1:-1] = 0
    with atomic_path(folder / AROUND) as temporary:
        Image.fromarray(around).save(temporary, optimize=True)
    copies = {GRATING: PATCHES / "hologram.toml", RING: STUDIO.parent / RING}
    copy = "" if mesh is None else mesh.name.replace("$", "_")  # $ begins a scene's parameter
    if mesh is not None:
        copies |= {os.path.relpath(f, mesh.parent): f for f in named_files(mesh)} | {copy: mesh}
    for name, source in copies.items():
        if (folder / name).exists() and source.samefile(folder / name):
            continue  # the mesh lies in the folder
        make_folder((folder / name).parent)
        with atomic_path(folder / name) as temporary:
            shutil.copyfile(source, temporary)
    ny, nx = foil.weight.shape
    # from centimetres to the texture, whose row 0 is at the top and whose margin has one texel
    size = np.array(place.size) * [nx / (nx - 2), ny / (ny - 2)]
    rows = place.matrix / size[:, None] * [[1.0], [-1.0]]
    rows[:, 2] += 0.5
    (a, b, c), (d, e, f) = rows
    low, high = (_DISTANCE * math.sin(math.radians(ring + side)) for side in (-1, 1))
    seen = max(place.size[1], place.size[0] / _PICTURE) / 2 / _FILLED  # half of the picture
    given = {
        "patch": GRATING, "around": AROUND,
        **{name: path.name for name, path in names._asdict().items()},
        "to_uv": " ".join(f"{x:.9g}" for x in (a, b, 0, c, d, e, 0, f, 0, 0, 1, 0, 0, 0, 0, 1)),
        "fov": f"{2 * math.degrees(math.atan(seen / _FAR)):.6g}" if mesh is None else "1",
        "half_width": f"{place.size[0] / 2:.6g}", "half_height": f"{place.size[1] / 2:.6g}",
        "ring_radius": f"{_DISTANCE * math.cos(math.radians(ring)):.6g}",
        "ring_low": f"{_MIDDLE + low:.6g}", "ring_high": f"{_MIDDLE + high:.6g}",
    }  # fmt: skip
    scene = folder / SCENE
    _write_scene(scene, given | values, copy)
    return scene


def _write_scene(file: Path, values: Mapping[str, str], mesh: str) -> None:
    """Write the scene with these defaults, and a mesh of this name in the card's place, if any."""
    builder = ElementTree.TreeBuilder(insert_comments=True)
    parser = ElementTree.XMLParser(target=builder)
    root = ElementTree.parse(STUDIO.parent / "label.xml", parser).getroot()
    for default in root.iter("default"):
        default.set("value", values.get(default.get("name", ""), default.get("value", "")))
    if mesh:
        shape = next(each for each in root.iter("shape") if each.get("id") == "label")
        shape.set("type", "fitted_mesh")
        placed = shape.find("transform")
        assert placed is not None
        placed[:] = [ElementTree.Element("rotate", z="1", angle="$turn")]
        texts = {"filename": mesh, "up": "$up", "frame": "$frame"}
        shape[:0] = [ElementTree.Element("string", name=k, value=v) for k, v in texts.items()]
    ElementTree.indent(root, "    ")
    text = '<?xml version="1.0" encoding="utf-8"?>\n' + ElementTree.tostring(root, "unicode")
    with atomic_path(file) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def described(parts: Areas) -> list[str]:
    """List the colours of a logo with the wavelengths that show them."""
    return [
        f"#{''.join(f'{round(c):02x}' for c in colour)}: "
        f"{' and '.join(f'{nm:.0f}' for nm in wavelengths_of(colour))} nm"
        for colour in parts.colours
    ]
