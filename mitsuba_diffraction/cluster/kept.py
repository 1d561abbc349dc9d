"""Sums of passes on disk, keyed by their task, until the picture that they make is written."""

from __future__ import annotations

import contextlib
import json
from dataclasses import asdict
from pathlib import Path

import numpy as np

from ..atomic import atomic_path
from .tasks import Sums, Task


class Kept:
    """A folder of sums; it is made when the first comes and removed when it is empty."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __contains__(self, task: Task) -> bool:
        return self._file(task).is_file()

    def write(self, task: Task, sums: Sums) -> None:
        """Keep a sum, in one piece or not at all."""
        self.folder.mkdir(parents=True, exist_ok=True)
        about = {k: v for k, v in asdict(sums).items() if k != "raw"}
        with atomic_path(self._file(task)) as temporary:
            np.savez(temporary, raw=sums.raw, about=np.array(json.dumps(about)))

    def read(self, task: Task) -> Sums | None:
        """What was kept; None if there is nothing, or it is damaged, which is removed."""
        try:
            with open(self._file(task), "rb") as stream, np.load(stream) as file:
                return Sums(raw=file["raw"], **json.loads(str(file["about"])))
        except FileNotFoundError:
            return None
        except Exception:  # any that zip files, arrays and JSON raise
            self._file(task).unlink(missing_ok=True)
            return None

    def forget(self, task: Task) -> None:
        """Remove a sum whose picture is written."""
        self._file(task).unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # others are in it
            self.folder.rmdir()

    def _file(self, task: Task) -> Path:
        return self.folder / f"{task.key[:32]}.npz"
