"""ΔE2000 between pictures of Cycles and of Mitsuba, and the part of it that is noise."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from docs.make.figures.pages import Seconds
from mitsuba_diffraction.arrays import Real, Single
from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.scene import read_exr

from .program import run_in_blender, seconds
from .views import View

#: Program that renders views in Blender, and the script that it adds exported materials with.
_INSIDE = Path(__file__).with_name("inside.py")


@dataclass(frozen=True)
class Comparison:
    """Pictures of both renderers and how far they differ where the shape is.

    Attributes
    ----------
    mitsuba, cycles : linear sRGB (height, width, 3), means of two halves of the samples.
    difference : mean ΔE2000 of the two pictures.
    noise : mean ΔE2000 that two such pictures of the same light would have.
    noise_of_cycles : the part of Cycles' picture in it.
    seconds : of Cycles, for all samples.
    """

    mitsuba: Single
    cycles: Single
    difference: float
    noise: float
    noise_of_cycles: float
    seconds: Seconds

    @property
    def beyond_noise(self) -> float:
        """Difference without the noise, which adds to it in squares."""
        return math.sqrt(max(self.difference**2 - self.noise**2, 0.0))


def compare(
    views: Sequence[View],
    folder: Path,
    *,
    mitsuba_samples: int,
    cycles_samples: int,
    working_space: str = "Linear Rec.2020",
    block: int = 1,
) -> list[Comparison]:
    """Render views with both renderers and compare them; a variant with colours must be set.

    Parameters
    ----------
    folder : for the files of Blender.
    mitsuba_samples, cycles_samples : per pixel.
    working_space : of Blender, by its name there.
    block : side of the blocks of pixels, whose means are compared: they have less noise.
    """
    halves, times = _cycles(views, folder, cycles_samples // 2, working_space)
    found = []
    for view, cycles, time in zip(views, halves, times, strict=True):
        scene = mi.load_dict(view.for_mitsuba())
        mitsuba = tuple(
            np.array(mi.render(scene, spp=mitsuba_samples // 2, seed=seed)) for seed in (0, 1)
        )
        depth = mi.render(scene, integrator=mi.load_dict({"type": "depth"}), spp=16)
        covered = blocks(np.array(depth)[..., :1] > 0.0, block)[..., 0] == 1.0
        means = [np.mean(pair, axis=0) for pair in (mitsuba, cycles)]
        halves_of_blocks = [[blocks(half, block) for half in pair] for pair in (mitsuba, cycles)]
        reference, other = (np.mean(pair, axis=0) for pair in halves_of_blocks)
        white = 1.0 / float(np.percentile(reference[covered].mean(axis=-1), 95.0))
        noise = [
            0.5 * _mean_delta_e(*pair, white, covered) for pair in halves_of_blocks
        ]  # the mean of two halves has half the noise of their difference
        difference = _mean_delta_e(reference, other, white, covered)
        whole = math.hypot(*noise)
        found.append(Comparison(*means, difference, whole, noise[1], time))
    return found


def blocks(picture: NDArray[Any], side: int) -> Real:
    """Return the means over blocks of pixels; the rest at the right and below is left out."""
    rows, columns = (size // side for size in picture.shape[:2])
    cut = picture[: rows * side, : columns * side].astype(np.float64)
    return cut.reshape(rows, side, columns, side, -1).mean(axis=(1, 3))


def _mean_delta_e(
    reference: Single, other: Single, exposure: float, covered: NDArray[np.bool_]
) -> float:
    return float(np.nanmean(delta_e(reference, other, exposure=exposure)[covered]))


def _cycles(
    views: Sequence[View], folder: Path, samples: int, working_space: str
) -> tuple[list[tuple[Single, Single]], list[Seconds]]:
    """Render all views twice, in one process."""
    jobs = [
        {
            "view": view.for_cycles(folder),
            "output": str(folder / f"cycles_{number}_{seed}.exr"),
            "samples": samples,
            "seed": seed,
            "working_space": working_space,
        }
        for number, view in enumerate(views)
        for seed in (0, 1)
    ]
    file = folder / "jobs.json"
    file.write_text(json.dumps(jobs), encoding="utf-8")
    times = seconds(run_in_blender(_INSIDE, [file]))
    pictures = [np.array(read_exr(Path(str(job["output"]))))[..., :3] for job in jobs]
    pairs = list(zip(pictures[::2], pictures[1::2], strict=True))
    both = zip(times[::2], times[1::2], strict=True)
    return pairs, [Seconds(*np.add(first, second)) for first, second in both]
