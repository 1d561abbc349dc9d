"""What a plan changes in the picture, measured on a small one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...optics.colour import delta_e, linear_srgb
from ...plugin.sampling import forget_sampler
from ...tables.table import DiffractionTable
from .plan import Plan
from .session import Session

#: Width at most, and samples per pixel.
WIDTH, SPP = 160, 64


@dataclass(frozen=True)
class Difference:
    """Between the pictures with whole and with planned tables, of the same random numbers."""

    relative: float  # mean |ΔXYZ| over mean XYZ, all pixels
    # delta_e_mean, delta_e_99: ΔE2000 of the pixels that are not black, or NaN
    delta_e_mean: float
    delta_e_99: float
    # size, spp: of the pictures
    size: tuple[int, int]
    spp: int


Picture = tuple[NDArray[np.float64], bool]


def difference(
    whole: Picture,
    tables: Mapping[str, DiffractionTable],
    load: Callable[[], Any],
    plan: Plan,
    sensor: Callable[[Any], Any],
) -> Difference:
    """Render with planned tables, with the random numbers and directions of the whole ones.

    Parameters
    ----------
    whole, tables : `small_picture` of the scene with whole tables, and those by key.
    load : loads the scene anew, in the variant that is set.
    plan : what it is to be loaded with.
    sensor : the sensor of a scene.
    """
    like = {key: tables[key] for key in plan.limits()}
    session = Session(limits=plan.limits(), sample_like=like)
    with session:
        planned = load()
    try:
        second, _ = small_picture(planned, sensor(planned))
    finally:
        for table in session.tables.values():
            forget_sampler(table)
        session.close()
    first, xyz = whole
    mean = float(first.mean())
    values = np.full(1, np.nan)
    if xyz:
        values = delta_e(linear_srgb(first), linear_srgb(second))
        values = values[np.isfinite(values)]
    height, width = first.shape[:2]
    return Difference(
        relative=float(np.abs(second - first).mean()) / mean if mean > 0.0 else float("nan"),
        delta_e_mean=float(values.mean()) if values.size else float("nan"),
        delta_e_99=float(np.percentile(values, 99.0)) if values.size else float("nan"),
        size=(width, height),
        spp=SPP,
    )


def small_picture(scene: Any, sensor: Any) -> Picture:
    """A small picture (height, width, channels), and whether it is in XYZ."""
    film = sensor.film()
    size = np.array(film.size(), int)
    if size[0] > WIDTH:
        parameters = mi.traverse(sensor)
        parameters["film.size"] = [WIDTH, max(1, round(WIDTH * int(size[1]) / int(size[0])))]
        parameters.update()
    mi.render(scene, sensor=sensor, spp=SPP, seed=0)
    root = dict(film.bitmap().split()).get("<root>")
    if root is None or root.pixel_format().name not in ("RGB", "RGBA", "XYZ", "XYZA"):
        return np.array(film.bitmap(), np.float64), False
    kinds = mi.Bitmap.PixelFormat
    converted = root.convert(kinds.XYZ, mi.Struct.Type.Float32, False)
    return np.array(converted, np.float64), True
