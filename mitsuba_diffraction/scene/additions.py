"""Meshes, lights and filters of a parsed scene changed before it is instantiated.

A shape of type `fitted_mesh` becomes a mesh on the stage (`fitted_mesh.py`).
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError, check_choice
from .fitted_mesh import FRAMES, fitted_mesh, framing, turned_around
from .mesh_materials import FITTED, OWN, PART, own_bsdf
from .orientation.mesh_files import load_mesh, write_ply
from .orientation.trimesh import TriangleMesh
from .surfaces import copied, inner, targets_of

# Properties of such a shape that say how its file is read
_OF_FILE = ("filename", "fit", "up", "frame", "others", PART, OWN)


def fit_meshes(state: Any, folder: Path) -> None:
    """Replace shapes of type `fitted_mesh` by PLY files of the fitted meshes.

    state : `mi.parser.ParserState`.
    folder : where the files are written.

    Raises a DiffractionError if a file is not a mesh, or cannot be put on the stage.
    """

    @cache
    def fitted(file: Path, fit: bool, up: str) -> TriangleMesh:
        return fitted_mesh(load_mesh(file), file, fit=fit, up=up)

    for number, node in enumerate(state.nodes):
        if node.props.plugin_name() != FITTED:
            continue
        props = node.props
        if "filename" not in props:
            raise DiffractionError(f"shape '{FITTED}': the parameter filename is missing")
        file = Path(str(mi.file_resolver().resolve(props["filename"])))
        fit, written = str(props.get("fit", "true")).lower(), folder / f"{number}.ply"
        check_choice("fit", fit, ("true", "false"))
        mesh = fitted(file, fit == "true", props.get("up", "auto"))
        _frame(state, mesh.positions, props)
        ply = copied(props, "ply", leave=_OF_FILE)
        if PART in props:
            assert mesh.materials is not None
            chosen = np.isin(mesh.materials, np.fromstring(props[PART], int, sep=" "))
            if not chosen.any():
                raise DiffractionError(f"mesh '{file}': its scene has no triangles of the material "
                                       f"'{props.id()}'; delete that material")  # fmt: skip
            mesh = mesh.part(chosen)
        if OWN in props:
            ply["bsdf"] = own_bsdf(file, props[OWN])
        write_ply(written, mesh)
        ply["filename"] = str(written)
        ply.set_id(props.id())
        node.props = ply


def _frame(state: Any, positions: NDArray[np.float64], shape: Any) -> None:
    """Move the scene's first camera until the mesh of a shape fills its picture."""
    frame = str(shape.get("frame", FRAMES[0]))
    check_choice("frame", frame, FRAMES)
    sensor = next((n for n in state.nodes if n.type == mi.ObjectType.Sensor), None)
    if frame == FRAMES[0] or sensor is None:
        return
    matrix = np.array(shape["to_world"].matrix) if "to_world" in shape else np.eye(4)
    placed = positions @ matrix[:3, :3].T + matrix[:3, 3]
    props = sensor.props
    pose = np.array(props["to_world"].matrix)
    film = state.nodes[next(iter(inner(state, sensor, mi.ObjectType.Film).values()))].props
    size = np.array([film.get("width", 768), film.get("height", 576)], float)
    tangents = size / size.min() * np.tan(np.radians(float(props["fov"]) / 2))
    seen = turned_around(placed) if frame == "turning" else placed
    pose[:3, 3] = framing(seen, pose[:3, :3], (tangents[0], tangents[1]))
    del props["to_world"]
    props["to_world"] = mi.ScalarTransform4f(pose)


def remove_dark_lights(state: Any) -> None:
    """Remove emitters of daylight's spectrum at scale 0, which Mitsuba refuses.

    state : `mi.parser.ParserState`, its references resolved.
    """
    black = {
        number
        for number, node in enumerate(state.nodes)
        if node.props.plugin_name() == "d65" and float(node.props.get("scale", 1.0)) == 0.0
    }
    if not black:  # reading a property hides from Mitsuba that no plugin reads it
        return
    for node in state.nodes:
        for name, number in inner(state, node, mi.ObjectType.Emitter).items():
            if black.intersection(targets_of(state.nodes[number]).values()):
                del node.props[name]


def put_box_filters(state: Any) -> None:
    """Give all films box filters, which keep the noise of each pixel apart, as denoisers need it.

    state : `mi.parser.ParserState`, its references resolved.
    """
    for node in state.nodes:
        if node.type != mi.ObjectType.Film:
            continue
        for name in inner(state, node, mi.ObjectType.ReconstructionFilter):
            del node.props[name]
        node.props["box"] = mi.load_dict({"type": "box"})
