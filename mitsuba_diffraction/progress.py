"""Progress callbacks of long work."""

from __future__ import annotations

from collections.abc import Callable

#: Called as progress(done, total, text); a total of 0 is not known yet.
Progress = Callable[[int, int, str], None]


def silent(done: int, total: int, text: str) -> None:
    """No-op progress callback."""


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
            self._progress(100 * number + 100 * done // total, 100 * self._count, text)

        return tell
