"""A Mitsuba scene as the realtime renderer knows it."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...plugin.names import name_of
from ...plugin.textures import check_attributes
from .camera import Camera, read_camera
from .lights import Lighting, emitted_radiance, read_lights
from .maps import Map
from .materials import Material, diffracts, read_material
from .shapes import Triangles, across, triangles_of
from .source import LIGHTS

Array = NDArray[np.float64]

#: What a vertex has: position, normal, tangent, texture coordinates, colour, axis.
VERTEX = (
    ("position", 3), ("normal", 3), ("tangent", 3), ("texcoord", 2), ("colour", 3), ("axis", 2)
)  # fmt: skip


@dataclass(frozen=True)
class Surface:
    """One shape.

    Attributes
    ----------
    name : for people.
    vertices : (n, 16) float32 as `VERTEX` says, three after another making a triangle.
    material : how it reflects.
    shape : of Mitsuba.
    exact : whether all of its material is shown.
    radiance : (3,) linear sRGB that it emits as well, the mean; None of most.
    """

    name: str
    vertices: NDArray[np.float32]
    material: Material
    shape: Any
    exact: bool
    radiance: Array | None = None


@dataclass(frozen=True)
class Glow:
    """A shape that emits light and reflects none.

    Attributes
    ----------
    vertices : as of a surface.
    radiance : (3,) linear sRGB, the mean.
    """

    vertices: NDArray[np.float32]
    radiance: Array


@dataclass(frozen=True)
class RealtimeScene:
    """What is shown of a scene.

    Attributes
    ----------
    surfaces, camera, lighting : in world space.
    low, high : (3,) corners of a box around all surfaces.
    omissions : what is not shown, or shown otherwise, in a few words each.
    emitting : shapes that emit light and reflect none.
    of_light : of the omissions, what progressive light does show.
    """

    surfaces: tuple[Surface, ...]
    camera: Camera
    lighting: Lighting
    low: Array
    high: Array
    omissions: tuple[str, ...]
    emitting: tuple[Glow, ...] = ()
    of_light: tuple[str, ...] = ()

    @property
    def glows(self) -> bool:
        """Whether anything in it emits light."""
        return bool(self.emitting) or any(s.radiance is not None for s in self.surfaces)

    @property
    def diffracting(self) -> tuple[Surface, ...]:
        """The surfaces that diffract."""
        return tuple(s for s in self.surfaces if s.material.bsdf is not None)

    @property
    def middle(self) -> Array:
        """(3,) of the box around what diffracts."""
        low, high = box_of([s.vertices[:, :3] for s in self.diffracting])
        return 0.5 * (low + high)


def load(scene: Any) -> Any:
    """A Mitsuba scene, of itself or of its file, in the variant that is set or llvm_ad_spectral.

    Raises
    ------
    DiffractionError
        If it is neither, the file cannot be loaded, or as of `check_variant`.
    """
    import mitsuba as mi

    if mi.variant() is not None:
        check_variant(mi.variant())
    if not isinstance(scene, str | os.PathLike):
        if mi.variant() is None or not isinstance(scene, mi.Scene):
            raise DiffractionError(
                f"scene={type(scene).__name__} is no Mitsuba scene of the variant that is set "
                f"({mi.variant()}); give mi.load_file(...) or mi.load_dict(...), or an XML file"
            )
        return scene
    from ...scene.load import load_scene, set_variant

    if mi.variant() is None:
        set_variant(None)
    return load_scene(Path(scene), {})


def check_variant(variant: str) -> None:
    """Raise a DiffractionError for a variant that reads values one by one, or knows no colours."""
    kind, _, colours = variant.partition("_")
    if kind == "scalar" or "mono" in colours:
        raise DiffractionError(
            f"the shaders draw in colours, and read all of a scene's lights and textures at once, "
            f"which {variant} does not: set llvm_ad_rgb or llvm_ad_spectral (--mode)"
        )


def read_scene(scene: Any, sensor: int = 0) -> RealtimeScene:
    """Read a Mitsuba scene.

    Parameters
    ----------
    scene : `mi.Scene` of the variant that is set.
    sensor : index of the camera.

    Raises
    ------
    DiffractionError
        If nothing in it diffracts, there is no perspective camera, or a mesh lacks an attribute.
    """
    sensors = scene.sensors()
    if not 0 <= sensor < len(sensors):
        raise DiffractionError(f"sensor={sensor}: the scene has {len(sensors)} sensors")
    camera, omissions = read_camera(sensors[sensor])
    shown = []
    for number, shape in enumerate(scene.shapes()):
        name = name_of(shape, number)
        check_attributes(shape, number)
        triangles = triangles_of(shape)
        if triangles is None:
            omissions.append(f"{name} ({shape.class_name()})")
            continue
        _check_texcoords(shape, name)
        shown.append((name, shape, triangles))
    middle = _middle([t for _, shape, t in shown if diffracts(shape.bsdf())])
    lighting = read_lights(scene, middle, LIGHTS)
    surfaces, emitting = [], []
    for name, shape, triangles in shown:
        before = len(omissions)
        material = read_material(shape.bsdf(), omissions, name, lighting.mean_spectrum)
        vertices = _vertices(triangles, material, shape)
        radiance = emitted_radiance(shape) if shape.is_emitter() else None
        if radiance is not None and material.black:
            emitting.append(Glow(vertices, radiance))
            continue
        exact = len(omissions) == before
        surfaces.append(Surface(name, vertices, material, shape, exact, radiance))
    low, high = box_of([s.vertices[:, :3] for s in surfaces])
    lens = ("the lens (shown as a pinhole)",) if camera.lens > 0.0 else ()
    of_light = (*lens, *lighting.omissions)
    return RealtimeScene(
        tuple(surfaces), camera, lighting, low, high, (*omissions, *of_light), tuple(emitting),
        of_light,
    )  # fmt: skip


def _check_texcoords(shape: Any, name: str) -> None:
    """Raise a DiffractionError for a mesh that diffracts but has no tangents of its own."""
    if shape.is_mesh() and diffracts(shape.bsdf()) and not shape.has_vertex_texcoords():
        raise DiffractionError(
            f"{name}: the mesh has no texture coordinates, along which the patch's axes lie; "
            "give it some (u along the patch's x axis), or use 'tangents' to make them"
        )


def _middle(triangles: list[Triangles]) -> Array:
    """Middle (3,) of what diffracts."""
    if not triangles:
        raise DiffractionError(
            "nothing in the scene diffracts that could be shown; give a mesh, rectangle, sphere, "
            "disk or cylinder a <bsdf type='diffraction'>"
        )
    low, high = box_of([t.positions for t in triangles])
    return 0.5 * (low + high)


def box_of(positions: Sequence[NDArray[np.floating]]) -> tuple[Array, Array]:
    """The lowest and highest corner (3,) of a box around all positions (n, 3)."""
    low = np.min([p.min(axis=0) for p in positions], axis=0)
    high = np.max([p.max(axis=0) for p in positions], axis=0)
    return low.astype(float), high.astype(float)


def _vertices(triangles: Triangles, material: Material, shape: Any) -> NDArray[np.float32]:
    count = len(triangles.positions)
    normals, tangents = triangles.normals, triangles.tangents
    # shaders divide by the length of what is left of it across the normal
    left = np.cross(normals, tangents)
    lost = np.sum(left**2, axis=1) <= 1e-12 * np.sum(tangents**2, axis=1)
    tangents = np.where(lost[:, None], across(normals), tangents)
    parts = [triangles.positions, normals, tangents, triangles.texcoords]
    parts += [
        _attribute(material.pigment, triangles, shape, 3),
        _attribute(material.axis, triangles, shape, 2),
    ]
    return np.concatenate([np.broadcast_to(p, (count, p.shape[-1])) for p in parts], axis=1).astype(
        np.float32
    )


def _attribute(value: Map, triangles: Triangles, shape: Any, channels: int) -> Array:
    """A map's value at all vertices."""
    if value.attribute is None or triangles.vertices is None:
        return value.value[:channels]
    import mitsuba as mi

    flat = np.array(mi.traverse(shape)[value.attribute], np.float64)
    if value.attribute.startswith("face_"):
        per_face = flat.reshape(len(triangles.vertices) // 3, -1)[:, :channels]
        return np.repeat(per_face, 3, axis=0)
    vertices = int(shape.vertex_count())
    return np.asarray(flat.reshape(vertices, -1)[triangles.vertices, :channels])
