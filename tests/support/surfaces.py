"""Surfaces that the path tracer, the shaders, the page and Cycles show alike: one table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

import mitsuba_diffraction as md
from tests.support.crossed import table as crossed_table
from tests.support.directions import rough_patch
from tests.support.orders import thin_grating

#: µm; lobes of 3° are wide enough for few samples.
WIDTH = 6.0
#: Wider: the shaders read one efficiency for all wavelengths of a lobe of solved orders.
SOLVED_WIDTH = 20.0
_PHASE = 2.0 * np.pi * np.arange(128) / 16.0
#: Asymmetric grooves without edges, which need few terms: period 1.5 µm.
GROOVES = md.HeightField(
    np.tile(0.04 * np.sin(_PHASE) + 0.015 * np.sin(2.0 * _PHASE + 0.7), (8, 1)), 1.5 / 16.0,
    name="grooves", periodic=True,
)  # fmt: skip
ROUGH = rough_patch((128, 128), (0.1, 0.1), 0.16)
_PLAIN = {"coherence_width": WIDTH, "energy_conserving": False}
_SIDE = 8
_STACK = 'layers = [["SiO2", 0.1], ["chitin", 0.08]]'


def _bitmap(values: Any) -> dict[str, Any]:
    """A raw texture that varies along u, of texels (n,) or (n, channels)."""
    texels = np.broadcast_to(np.asarray(values, np.float32), (_SIDE, *np.shape(values)))
    texels = texels[..., None] if texels.ndim == 2 else texels
    picture = mi.Bitmap(np.ascontiguousarray(texels))
    return {"type": "bitmap", "bitmap": picture, "raw": True, "wrap_mode": "clamp"}


def _diffuse(*colour: float) -> dict[str, Any]:
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(colour)}}


def _turned() -> dict[str, Any]:
    angle = np.linspace(0.0, 1.0, _SIDE)
    return _bitmap(np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1))


def _painted() -> dict[str, Any]:
    colours = np.full((_SIDE, 3), 0.1)
    colours[::2] = [0.5, 0.3, 0.1]
    return {"type": "diffuse", "reflectance": _bitmap(colours) | {"raw": False}}


def _heights(field: Any = GROOVES, **parameters: Any) -> Callable[[Path], dict[str, Any]]:
    """A surface of heights, mostly without scales of energy, which take seconds to tabulate.

    Parameters that are functions are called when it is loaded.
    """

    def make(folder: Path) -> dict[str, Any]:
        known = {name: p() if callable(p) else p for name, p in parameters.items()}
        return md.bsdf_dict(field, **(_PLAIN | known))

    return make


def _layered(folder: Path) -> dict[str, Any]:
    file = folder / "stack.toml"
    file.write_text(_STACK)
    return _heights(material="Al", layers=str(file))(folder)


def _mixed(folder: Path) -> dict[str, Any]:
    parts = {"grooves": _heights(material="Al")(folder), "paint": _diffuse(0.5, 0.3, 0.1)}
    weights = _bitmap(np.linspace(0.0, 1.0, _SIDE))
    return {"type": "diffraction_mix", **parts, "weight_grooves": weights}


def _solved(**parameters: Any) -> Callable[[Path], dict[str, Any]]:
    of_bsdf = {n: parameters.pop(n) for n in ("nested", "orientation") if n in parameters}
    return lambda _: md.bsdf_dict(
        thin_grating(**parameters), coherence_width=SOLVED_WIDTH,
        **{n: p() if callable(p) else p for n, p in of_bsdf.items()},
    )  # fmt: skip


_ORANGE = 0.5, 0.25, 0.1
#: BSDFs by name, made in a folder for their files.
SURFACES: dict[str, Callable[[Path], dict[str, Any]]] = {
    "mirror": _heights(material="none"),
    "aluminium": _heights(material="Al"),
    "gold": _heights(material="Au"),
    "own index": _heights(eta=0.5, k=3.0),
    "gold, rough": _heights(ROUGH, material="Au"),
    "glass": _heights(int_ior=1.5),
    "keratin": _heights(material="keratin"),
    "dense glass, rough": _heights(ROUGH, int_ior=2.4),
    "rarer than above": _heights(int_ior=1.0, ext_ior=1.33),
    "tangent plane": _heights(material="Au", model="kirchhoff"),
    "shadowing": _heights(material="Al", shadowing="vcavity"),
    "scaled energy": _heights(material="Al", energy_conserving=True),
    "scaled energy, rough": _heights(ROUGH, int_ior=1.8, energy_conserving=True),
    "lacquered metal": _heights(material="Al", coat_ior=1.5),
    "lacquered glass": _heights(int_ior=1.8, coat_ior=1.4),
    "lacquered gold, rough": _heights(ROUGH, material="Au", coat_ior=1.5),
    "pigment": _heights(int_ior=1.5, nested=lambda: _diffuse(*_ORANGE)),
    "pigment under lacquer": _heights(int_ior=1.8, coat_ior=1.4, nested=lambda: _diffuse(*_ORANGE)),
    "painted": _heights(int_ior=1.5, nested=_painted),
    "lower": _heights(material="Al", height_scale=0.6),
    "wider": _heights(material="Al", lateral_scale=1.4),
    "turned": _heights(material="Al", orientation=35.0),
    "turned by a texture": _heights(material="Al", orientation=_turned),
    "wider by a texture": _heights(
        material="Al", lateral_scale=lambda: _bitmap(np.linspace(0.8, 1.2, _SIDE))
    ),
    "mixed": _mixed,
    "speckle": _heights(ROUGH, material="Al", coherence="patch"),
    "solved": _solved(),
    "solved, turned": _solved(orientation=35.0),
    "solved over pigment": _solved(reflectance=0.4, nested=lambda: _diffuse(*_ORANGE)),
    "solved under a layer": _solved(superstrate=1.5),
    "film": _heights(material="Al", film_ior=1.5, film_thickness=300.0),
    "film by a texture": _heights(
        material="Al",
        film_ior=1.5,
        film_thickness_max=400.0,
        film_thickness=lambda: _bitmap(np.linspace(0.2, 1.0, _SIDE)),
    ),
    "stack": _layered,
    "interface": _heights(plugin="diffraction_dielectric"),
    "sheet": _heights(plugin="diffraction_dielectric", thin=True),
    "solved sheet": _solved(thin=True),
    "crossed": lambda _: md.bsdf_dict(crossed_table(), coherence_width=WIDTH),
    "speckle of places": _heights(ROUGH, material="Al", coherence="surface", uv_scale=12.8),
    "lower by a texture": _heights(
        material="Al", height_scale=lambda: _bitmap(np.linspace(0.3, 1.0, _SIDE))
    ),
}
