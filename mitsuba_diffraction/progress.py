"""Progress callbacks of long work."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

#: Called as progress(done, total, text); a total of 0 is not known yet.
Progress = Callable[[int, int, str], None]

_Part = TypeVar("_Part")


def silent(done: int, total: int, text: str) -> None:
    """No-op progress callback."""


# Of commands that load scenes, the current one last; Mitsuba hands no callback to its plugins.
_shown: list[Progress] = [silent]


@contextlib.contextmanager
def showing(progress: Progress) -> Iterator[None]:
    """Show by this callback what the BSDFs of scenes that load inside do."""
    _shown.append(progress)
    try:
        yield
    finally:
        _shown.remove(progress)


def show(done: int, total: int, text: str) -> None:
    """Progress callback of a BSDF that loads: that of the innermost `showing`."""
    _shown[-1](done, total, text)


def tracked(parts: Sequence[_Part], progress: Progress, text: str) -> Iterator[_Part]:
    """Yield parts of the work while a callback shows their number: each takes up to seconds."""
    for number, part in enumerate(parts):
        progress(number, len(parts), text)
        yield part


class Stages:
    """Progress of work in stages of about one length, which count as one.

    progress : called as progress(steps done, steps in all, text); a stage has 100 steps.
    count : number of stages.
    """

    def __init__(self, progress: Progress, count: int) -> None:
        self._progress, self._count, self._begun = progress, count, 0

    def next(self) -> Progress:
        """Begin a stage; return its progress callback."""
        number, self._begun = self._begun, self._begun + 1

        def tell(done: int, total: int, text: str) -> None:
            self._progress(100 * number + 100 * done // max(total, 1), 100 * self._count, text)

        return tell
