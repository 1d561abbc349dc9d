"""One scene on workers."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..errors import DiffractionError, DiffractionWarning
from ..progress import Progress, silent
from ..scene.load import set_variant
from ..scene.passes import Result, Stop
from .frames import Film, Wanted


def render(
    scene: str | os.PathLike[str],
    *,
    client: Any,
    parameters: Mapping[str, str] | None = None,
    spp: int | None = None,
    seed: int = 0,
    variant: str | None = None,
    sensor: int = 0,
    preview: bool = False,
    threads: int = 0,
    keep: str | os.PathLike[str] | None = None,
    progress: Progress = silent,
) -> Result:
    """Render a scene on the workers of a Dask cluster.

    The picture is, bit for bit, that of one process with as many Dr.Jit threads on such a
    processor: tasks are the same groups of passes, added up in the order of their seeds.

    Parameters
    ----------
    scene : XML file.
    client : `distributed.Client`; workers have one Dask thread each (`cluster.connect`).
    parameters : of the scene, as -D sets them.
    spp : samples per pixel; by default the scene's.
    seed : whole number from 0.
    variant : of Mitsuba; by default as `render` chooses it here.
    sensor : its number.
    preview : half the width and height, and at most 16 samples unless `spp` is given.
    threads : of Dr.Jit in every worker; 0 for one a core.
    keep : folder where finished passes wait for the picture, and where a later call with the same
        arguments finds them; by default a temporary one.
    progress : called as progress(tasks done, tasks in all, text).

    Returns
    -------
    `scene.passes.Result`, with the picture as a `mi.Bitmap`.

    Raises
    ------
    DiffractionError
        If a worker is of no use, or a task fails: with frame, passes and worker.
    """

    def warn(line: str) -> None:
        warnings.warn(line, DiffractionWarning, stacklevel=2)

    name = set_variant(variant)
    with tempfile.TemporaryDirectory() as temporary, Stop() as stop:
        film = Film(
            client, Path(scene), [Wanted(dict(parameters or {}), spp, seed)], name,
            keep=Path(keep or Path(temporary) / "passes"), warn=warn, sensor=sensor,
            preview=preview, threads=threads,
        )  # fmt: skip
        for result in film.render(stop, progress):
            film.forget(0)
            return result
    raise DiffractionError("interrupted: finished passes are kept where `keep` says")
