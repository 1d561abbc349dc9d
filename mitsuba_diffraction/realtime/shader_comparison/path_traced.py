"""Path-traced references: direct light of all emitters, an even mean over each pixel."""

from __future__ import annotations

from typing import Any

from ..glsl.camera import Camera


def direct_light(scene: Any, camera: Camera) -> Any:
    """Return the scene with its emitters, whose light is reflected once at most.

    The result has one sensor, whose film averages evenly over each pixel.
    """
    import mitsuba as mi

    parts = {f"shape_{number}": shape for number, shape in enumerate(scene.shapes())}
    emitters = (emitter for emitter in scene.emitters() if emitter.get_shape() is None)
    parts |= {f"light_{number}": emitter for number, emitter in enumerate(emitters)}
    integrator = {"type": "path", "max_depth": 2}
    return mi.load_dict(
        {"type": "scene", "integrator": integrator, "sensor": box_sensor(camera), **parts}
    )


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
