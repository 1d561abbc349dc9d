"""A survey of scans of 10 µm, as the command runs it, in a cache of its own."""

from __future__ import annotations

import importlib.util
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from docs.make.figures.pages import timed
from mitsuba_diffraction.progress import Progress

from .figures import FULL, Goal, Plan, Row, Section

#: Seconds that the scans of a full run may take on two cores.
MOST = 60.0
_SIDE, _PIXELS = 10.0, 256  # µm, and pixels a side


def measure_survey(plan: Plan, folder: Path, progress: Progress) -> Section:
    """Time `survey` of gratings with roughness, in one process and on two workers."""
    files = _scans(folder, plan.scans)
    ways = {"one process": []}
    if plan.scans > 1 and importlib.util.find_spec("distributed") is not None:
        ways["two workers"] = ["--workers", "2"]
    rows = []
    for n, (name, options) in enumerate(ways.items()):
        progress(n, len(ways), f"survey, {name}")
        made = folder / name.split()[0]
        (seconds, busy), _ = timed(
            [
                "survey", *files, "--repeats", "folder", "--pixel-size", _SIDE / _PIXELS,
                "-o", made / "survey", "--no-progress", *options,
            ],
            MITSUBA_DIFFRACTION_CACHE=str(made / "cache"),
        )  # fmt: skip
        goals = [Goal(f"at most {MOST:g} s", seconds <= MOST)] if plan.scans == FULL.scans else []
        values = {
            "s": seconds, "s a scan": seconds / plan.scans,
            "s of all cores a scan": busy / plan.scans,
        }  # fmt: skip
        rows.append(Row(name, values, goals))
    progress(len(ways), len(ways), "surveyed")
    return Section(
        f"survey: {plan.scans} scans of {_SIDE:g} µm, {_PIXELS}² pixels, each way once, with an "
        "empty cache and the start of the processes",
        rows,
    )


def _scans(folder: Path, count: int) -> list[Path]:
    """Write scans of turned gratings with roughness."""
    generator = np.random.default_rng(5)
    x = _SIDE / _PIXELS * np.arange(_PIXELS)
    files = []
    for n in range(count):
        angle, period = generator.uniform(0.0, np.pi), generator.uniform(0.7, 2.0)
        along = np.cos(angle) * x + np.sin(angle) * x[:, None]
        rough = gaussian_filter(generator.normal(size=(_PIXELS, _PIXELS)), 2)
        files.append(folder / f"scan-{n:02d}.npy")
        np.save(files[-1], 0.02 * np.sin(2.0 * np.pi * along / period) + 0.03 * rough)
    return files
