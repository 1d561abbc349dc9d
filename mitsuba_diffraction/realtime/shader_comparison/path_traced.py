"""Path-traced references: direct light of all emitters, or of points and directions alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import daylight
from ..glsl.camera import Camera
from ..glsl.lights import Lamp
from ..glsl.maps import uploaded
from .measures import Visibility

_RAYS = 4  # rays along either side of a pixel in `visibility`


def direct_light(scene: Any, camera: Camera) -> Any:
    """Return the scene with its emitters, whose light is reflected once at most.

    The result has one sensor, whose film averages evenly over each pixel.
    """
    emitters = [emitter for emitter in scene.emitters() if emitter.get_shape() is None]
    return _joined({"type": "path", "max_depth": 2}, camera, scene.shapes(), emitters)


def with_lights(scene: Any, camera: Camera, lights: Sequence[Lamp]) -> Any:
    """Return the scene's shapes under these lights alone, whose light is reflected once.

    Shapes that emit light are left out: their light is among `lights`. The result has one sensor,
    whose film averages evenly over each pixel, as supersampling does.
    """
    # rays never hit lights without extent: no BSDF samples
    integrator = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
    shapes = [shape for shape in scene.shapes() if not shape.is_emitter()]
    return _joined(integrator, replace(camera, lens=0.0), shapes, [_emitter(n) for n in lights])


def _joined(
    integrator: dict[str, Any], camera: Camera, shapes: Sequence[Any], emitters: Sequence[Any]
) -> Any:
    """Return a scene of these parts, with a sensor for this camera."""
    import mitsuba as mi

    parts = {f"shape_{number}": shape for number, shape in enumerate(shapes)}
    parts |= {f"light_{number}": emitter for number, emitter in enumerate(emitters)}
    sensor = box_sensor(camera)
    return mi.load_dict({"type": "scene", "integrator": integrator, "sensor": sensor, **parts})


def box_sensor(camera: Camera) -> Any:
    """Return a sensor for this camera, whose film averages evenly over each pixel."""
    import mitsuba as mi

    width, height = camera.size
    lens: dict[str, Any] = {
        "type": "perspective",
        "principal_point_offset_x": camera.offset[0],
        "principal_point_offset_y": camera.offset[1],
    }
    if camera.lens > 0.0:
        lens = {
            "type": "thinlens", "aperture_radius": camera.lens, "focus_distance": camera.focus
        }  # fmt: skip
    return mi.load_dict(
        {
            **lens,
            "to_world": mi.ScalarTransform4f(camera.to_world),
            "fov": camera.fov,
            "fov_axis": "x",
            "sampler": {"type": "multijitter"},
            "film": {
                "type": "hdrfilm", "width": width, "height": height, "pixel_format": "rgb",
                "component_format": "float32", "rfilter": {"type": "box"},
            },
        }
    )  # fmt: skip


def _emitter(light: Lamp) -> dict[str, Any]:
    """Return the Mitsuba emitter of a light."""
    place = np.asarray(light.place, float)
    if place[3] == 0.0:
        direction = (-place[:3]).tolist()
        return {"type": "directional", "direction": direction, "irradiance": _spectrum(light)}
    return {"type": "point", "position": place[:3].tolist(), "intensity": _spectrum(light)}


def _spectrum(light: Lamp) -> dict[str, Any]:
    """Return the Mitsuba spectrum of a light, in the current variant."""
    import mitsuba as mi

    if not mi.is_spectral:
        return {"type": "rgb", "value": [float(c) for c in light.colour]}
    values = light.spectrum * daylight(light.wavelengths)
    return {
        "type": "irregular",
        "wavelengths": ", ".join(f"{x:.9g}" for x in light.wavelengths),
        "values": ", ".join(f"{x:.9g}" for x in values),
    }


def visibility(scene: Any, lights: Sequence[Lamp]) -> Visibility:
    """Trace a grid of rays in each pixel of a scene of `with_lights`."""
    import drjit as dr
    import mitsuba as mi

    sensor = scene.sensors()[0]
    width, height = (int(n) for n in sensor.film().size())
    shapes = scene.shapes_dr()
    first: NDArray[np.int64] | None = None
    same = np.ones((height, width), bool)
    lit = np.ones((height, width), bool)
    y, x = np.mgrid[:height, :width]
    for j in range(_RAYS):
        for i in range(_RAYS):
            places = np.stack([(x + (i + 0.5) / _RAYS) / width, (y + (j + 0.5) / _RAYS) / height])
            place = mi.Point2f(*uploaded(places.reshape(2, -1).T))
            ray, _ = sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
            si = scene.ray_intersect(ray)
            index = mi.Int32(-1)
            for number in range(len(shapes)):
                index = dr.select(si.shape == shapes[number], number, index)
            index = dr.select(si.is_valid(), index, -1)
            shape = np.array(index, np.int64).reshape(height, width)
            first = shape if first is None else first
            same &= shape == first
            lit &= _lit(scene, si, lights).reshape(height, width)
    assert first is not None
    return Visibility(np.where(same, first, -2), lit)


def _lit(scene: Any, si: Any, lights: Sequence[Lamp]) -> NDArray[np.bool_]:
    """Return whether every light above the surface reaches it, and at least one is above it."""
    import mitsuba as mi

    clear, any_above = mi.Mask(True), mi.Mask(False)
    for light in lights:
        place = mi.Point3f(*(float(x) for x in light.place[:3]))
        if light.place[3] == 0.0:
            ray = si.spawn_ray(mi.Vector3f(place))
            direction = mi.Vector3f(place)
        else:
            ray = si.spawn_ray_to(place)
            direction = place - si.p
        # above: on the side of the surface that the ray hits
        above = si.sh_frame.cos_theta(si.to_local(direction)) * si.wi.z > 0.0
        clear &= ~above | ~scene.ray_test(ray, si.is_valid() & above)
        any_above |= above
    return np.array(si.is_valid() & clear & any_above, bool)
