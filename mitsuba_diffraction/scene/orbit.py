"""Orbit of the cameras of any scene around its diffracting surfaces."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError

#: Scene parameter: degrees by which the cameras are turned around the vertical.
ORBIT = "render:orbit"
# Weight of "cameras look down" beside "up is up": a camera at 45° has two axes as near to its up.
_DOWN = 0.35


def turn_cameras(sensors: Iterable[Any], shapes: Iterable[Any], degrees: float) -> None:
    """Turn cameras around the vertical axis through the middle of shapes.

    sensors, shapes : of a loaded scene, in the variant that is set.

    Raises a DiffractionError if a sensor has no place.
    """
    boxes = [shape.bbox() for shape in shapes]
    if not boxes:
        raise DiffractionError(f"{ORBIT}: the scene has no shape that the camera could circle")
    low = np.min([np.ravel(box.min) for box in boxes], axis=0)
    high = np.max([np.ravel(box.max) for box in boxes], axis=0)
    middle = ((low + high) / 2).tolist()
    back = [-length for length in middle]
    for sensor in sensors:
        values = mi.traverse(sensor)
        if "to_world" not in values:
            raise DiffractionError(f"{ORBIT}: {sensor.class_name()} has no place to be turned from")
        pose = np.array(values["to_world"].matrix, float).reshape(4, 4)
        upwards = vertical(pose[:3, 1], pose[:3, 2]).tolist()
        around = mi.Transform4f().translate(middle).rotate(upwards, degrees).translate(back)
        values["to_world"] = around @ values["to_world"]
        values.update()


def vertical(up: NDArray[np.float64], forwards: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the axis of the world, (3,), that points upwards in the picture of a camera.

    up, forwards : (3,) axes of the camera. Of two axes as near to `up`, cameras look down one.
    """
    axes = np.concatenate([np.eye(3), -np.eye(3)])
    return np.asarray(axes[np.argmax(axes @ up - _DOWN * (axes @ forwards))])
