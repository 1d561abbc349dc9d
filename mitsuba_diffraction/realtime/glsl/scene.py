"""Mitsuba scenes as triangles, materials, lights and a camera for the realtime renderer."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...errors import DiffractionError
from ...plugin.description import Surface
from ...scene.elements import check_attributes, has_texcoords, name_of
from ...scene.orientation.mesh_files import mesh_arrays
from ...scene.orientation.trimesh import grid_faces, texture_tangents
from ...shading.spectra import uploaded
from .camera import Camera, read_camera
from .lights import Lighting, emitted_radiance, read_lights
from .maps import Map
from .shader_materials import ShaderMaterial, diffracts, read_materials
from .source import LIGHTS

_RINGS, _SEGMENTS = 192, 384  # triangles of a sphere lie within 3e-5 of its radius
_SAME = 1e-6  # distance of points that are equal, relative to the extent of a surface
_BITS = 21  # bits of a coordinate in units of that distance

#: Attributes of a vertex and their number of components.
VERTEX = (
    ("position", 3), ("normal", 3), ("tangent", 3), ("texcoord", 2), ("colour", 3), ("axis", 3)
)  # fmt: skip


@dataclass(frozen=True)
class Triangles:
    """Vertices in world space; three consecutive ones are a triangle."""

    positions: Real  # (n, 3)
    normals: Real  # (n, 3)
    tangents: Real  # (n, 3), ∂p/∂u, of any length
    texcoords: Real  # (n, 2)
    # (n,) index of each vertex in its mesh, or None
    vertices: NDArray[np.int64] | None = None


def triangles_of(shape: Any) -> Triangles | None:
    """Return the triangles of a shape, or None for an unsupported kind."""
    grid = _ANALYTIC.get(shape.class_name())
    if grid is not None:
        import mitsuba as mi

        to_world = np.array(mi.traverse(shape)["to_world"].matrix, np.float64).reshape(4, 4)
        return _transformed(_grid(*grid), to_world, *sample_normal(shape))
    return _mesh_triangles(shape) if shape.is_mesh() else None


def sample_normal(shape: Any) -> tuple[Real, Real]:
    """Return a point of a shape and the normal at it, (3,) each, `flip_normals` included."""
    import mitsuba as mi

    sample = shape.sample_position(0.0, mi.Point2f(0.3, 0.4))
    place, normal = (np.array(x, np.float64).reshape(3, -1)[:, 0] for x in (sample.p, sample.n))
    return place, normal


def _transformed(local: Triangles, to_world: Real, place: Real, normal: Real) -> Triangles:
    """Transform triangles to world space, with normals on the same side as `normal` at `place`."""
    linear = to_world[:3, :3]
    positions = local.positions @ linear.T + to_world[:3, 3]
    normals = local.normals @ np.linalg.inv(linear)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    nearest = ((positions - place) ** 2).sum(axis=1).argmin()
    return Triangles(
        positions=positions,
        normals=-normals if normals[nearest] @ normal < 0.0 else normals,
        tangents=local.tangents @ linear.T,
        texcoords=local.texcoords,
    )


def _mesh_triangles(shape: Any) -> Triangles:
    """Return the triangles of a mesh, each with the tangent of its texture coordinates."""
    mesh = mesh_arrays(shape)
    corners = mesh.faces.ravel()
    positions = mesh.positions[corners]
    sides = positions.reshape(-1, 3, 3)[:, 1:] - positions[::3, None]
    flat = np.cross(sides[:, 0], sides[:, 1])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-300)
    normals = np.repeat(flat, 3, axis=0)
    if mesh.normals is not None:
        normals = mesh.normals[corners]
    tangents = default_tangents(flat)
    texcoords = np.zeros((len(corners), 2))
    if mesh.uv is not None:
        texcoords = mesh.uv[corners]
        uv_sides = texcoords.reshape(-1, 3, 2)[:, 1:] - texcoords[::3, None]
        dp_du, _, area = texture_tangents(sides, uv_sides)
        tangents = np.where(area[:, None] != 0.0, dp_du, tangents)
    return Triangles(positions, normals, np.repeat(tangents, 3, axis=0), texcoords, corners)


def default_tangents(normals: Real) -> Real:
    """Return Mitsuba's tangents without texture coordinates, (n, 3)."""
    import mitsuba as mi

    tangents, _ = mi.coordinate_system(mi.Vector3f(*uploaded(normals)))
    return np.array(tangents, np.float64).T


def _grid(rows: int, columns: int, point: Callable[[Real, Real], tuple[Real, ...]]) -> Triangles:
    """Tessellate a parametrisation (u, v) ↦ position, normal, tangent."""
    s, t = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    position, normal, tangent = point(s.ravel(), t.ravel())
    index = grid_faces(np.arange(s.size).reshape(s.shape).T).ravel()
    uv = np.stack([s.ravel(), t.ravel()], axis=1)
    # of a plane, normals and tangents are one vector
    normal, tangent = (np.broadcast_to(x, position.shape) for x in (normal, tangent))
    return Triangles(position[index], normal[index], tangent[index], uv[index])


_X, _Z = np.eye(3)[[0, 2]]


def _around(turns: Real) -> tuple[Real, Real]:
    """Return unit vectors (n, 3) at angles around the z axis, and those along the circle."""
    cos, sin = np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)
    return np.stack([cos, sin, 0.0 * cos], axis=1), np.stack([-sin, cos, 0.0 * cos], axis=1)


def _rectangle(u: Real, v: Real) -> tuple[Real, ...]:
    """Return positions, normals and tangents of Mitsuba's rectangle."""
    return np.stack([2.0 * u - 1.0, 2.0 * v - 1.0, 0.0 * u], axis=1), _Z, 2.0 * _X


def _sphere(u: Real, v: Real) -> tuple[Real, ...]:
    """Return positions, normals and tangents of Mitsuba's sphere."""
    outward, along = _around(u)
    p = np.sin(np.pi * v)[:, None] * outward + np.cos(np.pi * v)[:, None] * _Z
    return p, p, along


def _disk(u: Real, v: Real) -> tuple[Real, ...]:
    """Return positions, normals and tangents of Mitsuba's disk."""
    radial, _ = _around(v)  # Mitsuba's u is the radius, v the azimuth
    return u[:, None] * radial, _Z, radial


def _cylinder(u: Real, v: Real) -> tuple[Real, ...]:
    """Return positions, normals and tangents of Mitsuba's cylinder."""
    outward, along = _around(u)
    return outward + v[:, None] * _Z, outward, along


#: Rows, columns and parametrisation of each analytic shape.
_ANALYTIC = {
    "Rectangle": (1, 1, _rectangle),
    "Sphere": (_RINGS, _SEGMENTS, _sphere),
    "Disk": (_SEGMENTS, 8, _disk),
    "Cylinder": (1, _SEGMENTS, _cylinder),
}


@dataclass(frozen=True)
class SceneSurface:
    """A shape that reflects or emits light: triangles and material."""

    name: str  # name in messages
    # (n, 17) attributes of `VERTEX`; three consecutive vertices are a triangle
    vertices: NDArray[np.float32]
    material: ShaderMaterial
    shape: Any  # shape of Mitsuba
    radiance: Real | None = None  # (3,) linear sRGB, mean emitted radiance; None without light

    @property
    def lamp(self) -> bool:
        """Whether the shape emits light and reflects none."""
        return self.radiance is not None and self.material.black

    @property
    def table(self) -> Any:
        """Table of heights or of solved orders; None where nothing diffracts."""
        diffraction = self.material.diffraction
        return None if diffraction is None else diffraction.table

    @cached_property
    def _solid(self) -> tuple[Real, Real, int]:
        """Corners of a box around the surface, and the winding of a closed one, else 0."""
        corners = self.vertices[:, :3].reshape(-1, 3, 3).astype(np.float64)
        return *box_of([self.vertices[:, :3]]), winding_of(corners)

    def winding_from(self, place: Real) -> int:
        """Return the winding of a surface that is closed and seen from outside, else 0.

        place : (4,) position and 1, or direction and 0.
        """
        low, high, winding = self._solid
        inside = (place[:3] >= low) & (place[:3] <= high)
        return 0 if place[3] and inside.all() else winding


def winding_of(triangles: Real) -> int:
    """Return 1 of closed triangles (n, 3, 3), counter-clockwise from outside, −1 clockwise, else 0.

    Closed triangles traverse each edge equally often in both directions.
    """
    low = triangles.min(axis=(0, 1))
    step = max(float(np.ptp(triangles, axis=(0, 1)).max()), 1e-30) * _SAME
    x, y, z = np.rint((triangles - low) / step).astype(np.int64).transpose(2, 0, 1)
    corner = np.unique((x << _BITS | y) << _BITS | z, return_inverse=True)[1].reshape(-1, 3)
    start, end = corner.ravel(), np.roll(corner, -1, axis=1).ravel()
    start, end = start[start != end], end[start != end]
    count = int(corner.max()) + 1
    if not np.array_equal(np.sort(start * count + end), np.sort(end * count + start)):
        return 0
    a, b, c = (triangles - triangles.mean(axis=(0, 1))).transpose(1, 0, 2)
    return int(np.sign(np.einsum("ni,ni->", a, np.cross(b, c))))


@dataclass(frozen=True)
class RealtimeScene:
    """The supported parts of a scene, in world space."""

    surfaces: tuple[SceneSurface, ...]
    camera: Camera
    lighting: Lighting
    low: Real  # (3,) lowest corner of a box around all surfaces that reflect light
    high: Real  # (3,) highest corner
    omissions: tuple[str, ...]  # parts that are left out or simplified, in a few words each
    of_light: tuple[str, ...] = ()  # omissions that progressive light does support

    @property
    def diffracting(self) -> tuple[Surface, ...]:
        """Descriptions of all surfaces that diffract."""
        all_surfaces = (surface.material.diffraction for surface in self.surfaces)
        return tuple(surface for surface in all_surfaces if surface is not None)

    @property
    def subject(self) -> tuple[Real, Real]:
        """Lowest and highest corner (3,) of the box around all surfaces that diffract."""
        subjects = (s for s in self.surfaces if s.material.diffraction is not None)
        return box_of([s.vertices[:, :3] for s in subjects])

    @property
    def middle(self) -> Real:
        """Middle (3,) of the box around all surfaces that diffract."""
        return np.asarray(0.5 * np.add(*self.subject))


def load(scene: Any) -> Any:
    """Return a Mitsuba scene or load its file, in the current variant or llvm_ad_spectral.

    Raises a DiffractionError if `scene` is neither, the file cannot be loaded, or the variant is
    not supported.
    """
    import mitsuba as mi

    if mi.variant() is not None:
        check_variant(mi.variant())
    if not isinstance(scene, str | os.PathLike):
        if mi.variant() is None or not isinstance(scene, mi.Scene):
            raise DiffractionError(
                f"scene={type(scene).__name__} is not a Mitsuba scene of the current variant "
                f"({mi.variant()}); give mi.load_file(...) or mi.load_dict(...), or an XML file"
            )
        return scene
    from ...scene import load_scene, set_variant

    if mi.variant() is None:
        set_variant(None)
    return load_scene(Path(scene), {})


def check_variant(variant: str) -> None:
    """Refuse a scalar or monochrome variant."""
    kind, _, colours = variant.partition("_")
    if kind == "scalar" or "mono" in colours:
        raise DiffractionError(
            f"variant {variant} does not support the shaders, which need colours and arrays of "
            "values: set llvm_ad_rgb or llvm_ad_spectral"
        )


def read_scene(scene: Any, sensor: int = 0) -> RealtimeScene:
    """Read the supported parts of a Mitsuba scene.

    Raises a DiffractionError if no supported shape diffracts, the camera is not a perspective one,
    or a mesh lacks an attribute.
    """
    sensors = scene.sensors()
    if not 0 <= sensor < len(sensors):
        raise DiffractionError(
            f"sensor={sensor} must be from 0 to {len(sensors) - 1}, the scene's sensors"
        )
    camera, omissions = read_camera(sensors[sensor])
    supported = []
    for number, shape in enumerate(scene.shapes()):
        name = name_of(shape, number)
        check_attributes(shape, name)
        triangles = triangles_of(shape)
        if triangles is None:
            omissions.append(f"{name} ({shape.class_name()})")
            continue
        _check_texcoords(shape, name)
        supported.append((name, shape, triangles))
    subjects = [t.positions for _, shape, t in supported if diffracts(shape.bsdf())]
    if not subjects:
        raise DiffractionError(
            "no supported shape of the scene diffracts; give a mesh, rectangle, sphere, disk or "
            "cylinder a <bsdf type='diffraction'>"
        )
    lighting = read_lights(scene, 0.5 * np.add(*box_of(subjects)), LIGHTS)
    surfaces = []
    for name, shape, triangles in supported:
        materials = read_materials(shape.bsdf(), omissions, name, lighting.mean_spectrum)
        radiance = emitted_radiance(shape) if shape.is_emitter() else None
        # the surfaces of a mix share the triangles, and each is drawn where it has a weight
        for material in materials:
            vertices = _vertices(triangles, material, shape)
            surfaces.append(SceneSurface(name, vertices, material, shape, radiance))
    low, high = box_of([s.vertices[:, :3] for s in surfaces if not s.lamp])
    lens = ("the lens (shown as a pinhole)",) if camera.lens > 0.0 else ()
    of_light = (*lens, *lighting.omissions)
    return RealtimeScene(
        tuple(surfaces), camera, lighting, low, high, (*omissions, *of_light), of_light
    )


def _check_texcoords(shape: Any, name: str) -> None:
    """Refuse a mesh that diffracts but has no texture coordinates for its tangents."""
    if shape.is_mesh() and diffracts(shape.bsdf()) and not has_texcoords(shape):
        raise DiffractionError(
            f"{name}: the mesh has no texture coordinates, which define the patch's axes; add "
            "them (u along the patch's x axis), or generate them with 'tangents'"
        )


def box_of(positions: Sequence[NDArray[np.floating]]) -> tuple[Real, Real]:
    """Return the lowest and highest corner (3,) of a box around all positions (n, 3)."""
    low = np.min([p.min(axis=0) for p in positions], axis=0)
    high = np.max([p.max(axis=0) for p in positions], axis=0)
    return low.astype(float), high.astype(float)


def _vertices(triangles: Triangles, material: ShaderMaterial, shape: Any) -> NDArray[np.float32]:
    """Return the attributes of all vertices, (n, 17), in the order of `VERTEX`."""
    count = len(triangles.positions)
    normals, tangents = triangles.normals, triangles.tangents
    # tangents along the normal are replaced: shaders normalise the part across the normal
    perpendicular = np.cross(normals, tangents)
    parallel = np.sum(perpendicular**2, axis=1) <= 1e-12 * np.sum(tangents**2, axis=1)
    tangents = np.where(parallel[:, None], default_tangents(normals), tangents)
    parts = [triangles.positions, normals, tangents, triangles.texcoords]
    parts += [
        _attribute(material.pigment, triangles, shape, 3),
        _attribute(material.axis, triangles, shape, 2),
        material.axis.value[2:],
    ]
    return np.concatenate([np.broadcast_to(p, (count, p.shape[-1])) for p in parts], axis=1).astype(
        np.float32
    )


def _attribute(value: Map, triangles: Triangles, shape: Any, channels: int) -> Real:
    """Return the value of a map at all vertices, (n, channels) or (channels,)."""
    if value.attribute is None or triangles.vertices is None:
        return value.value[:channels]
    import mitsuba as mi

    flat = np.array(mi.traverse(shape)[value.attribute], np.float64)
    if value.attribute.startswith("face_"):
        per_face = flat.reshape(len(triangles.vertices) // 3, -1)[:, :channels]
        return np.repeat(per_face, 3, axis=0)
    vertices = int(shape.vertex_count())
    return np.asarray(flat.reshape(vertices, -1)[triangles.vertices, :channels])
