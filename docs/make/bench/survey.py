"""A survey of scans of 10 µm, as the command runs it, in a cache of its own."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from scipy.ndimage import gaussian_filter

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.progress import Progress

from .figures import FULL, Goal, Plan, Row, Section

#: Seconds that the scans of a full run may take on two cores.
MOST = 60.0
_SIDE, _PIXELS = 10.0, 256  # µm, and pixels a side


def measure_survey(plan: Plan, folder: Path, progress: Progress) -> Section:
    """Time `survey` of gratings with roughness, in one process and on two workers."""
    files = [str(file) for file in _scans(folder, plan.scans)]
    ways = {"one process": []}
    if plan.scans > 1 and importlib.util.find_spec("distributed") is not None:
        ways["two workers"] = ["--workers", "2"]
    rows = []
    for n, (name, options) in enumerate(ways.items()):
        progress(n, len(ways), f"survey, {name}")
        seconds, busy = _timed(files, folder / name.split()[0], options)
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


def _timed(files: list[str], folder: Path, options: list[str]) -> tuple[float, float]:
    """Return the seconds that the command takes, and those of all its processes."""
    command = [
        sys.executable, "-m", "mitsuba_diffraction", "survey", *files, "--repeats", "folder",
        "--pixel-size", str(_SIDE / _PIXELS), "-o", str(folder / "survey"), *options,
    ]  # fmt: skip
    start, before = time.perf_counter(), os.times()
    cache = {"MITSUBA_DIFFRACTION_CACHE": str(folder / "cache")}
    ran = subprocess.run(command, env=os.environ | cache, capture_output=True, text=True)
    if ran.returncode:
        said = ran.stderr.strip().splitlines() or [f"exit code {ran.returncode}"]
        raise DiffractionError(f"the survey failed: {said[-1]}")
    after = os.times()
    busy = sum(end - begin for begin, end in zip(before[2:4], after[2:4], strict=True))
    return time.perf_counter() - start, busy
