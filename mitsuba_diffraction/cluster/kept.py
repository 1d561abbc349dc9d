"""Sums of passes on disk, from which a command that was stopped goes on."""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from pathlib import Path

from ..atomic import make_folder
from ..scene.passes import Span
from ..tables.store import Record, found, write_record
from .tasks import Sums, Task


@dataclass(frozen=True)
class Kept:
    """Folder of sums on disk, created when the first comes and removed when it is empty.

    Parameters
    ----------
    folder : where the files lie, one for each sum of a frame's passes.
    """

    folder: Path

    def spans(self, frame: Task) -> set[Span]:
        """Return the passes of a frame whose sums are stored."""
        names = (path.stem.split("-")[1:] for path in self._files(frame))
        return {Span(int(first), int(count)) for first, count in names}

    def write(self, frame: Task, span: Span, sums: Sums) -> None:
        """Write the sum of passes of a frame whole."""
        make_folder(self.folder)
        about = {name: value for name, value in vars(sums).items() if name != "raw"}
        write_record(self._file(frame, span), _title(frame, span), Record(about, [sums.raw]))

    def read(self, frame: Task, span: Span) -> Sums | None:
        """Read a sum; None if it is missing, or damaged, which is removed."""

        def sums_in(record: Record) -> Sums:
            return Sums(raw=record.arrays[0], **record.document)

        return found(self._file(frame, span), _title(frame, span), sums_in)

    def forget(self, frame: Task) -> None:
        """Remove the sums of a frame whose picture is written."""
        for file in self._files(frame):
            file.unlink(missing_ok=True)
        with contextlib.suppress(OSError):  # others are in it
            self.folder.rmdir()

    def _files(self, frame: Task) -> list[Path]:
        return list(self.folder.glob(f"{frame.key[:32]}-*-*.sum"))

    def _file(self, frame: Task, span: Span) -> Path:
        return self.folder / f"{frame.key[:32]}-{span.first}-{span.count}.sum"


def _title(frame: Task, span: Span) -> str:
    """Return the first line of a sum's file: its kind, the key of its frame, and its passes."""
    return f"mitsuba_diffraction sum {frame.key} {span.first} {span.count}"
