"""Progress bars: on stderr, only where somebody watches, only for what takes a while."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from types import TracebackType
from typing import Any, Self

# Of a terminal that reports no size, as in some containers and editors.
_SIZE = 80, 24

# Below it a bar would only flash by.
_DELAY = 0.5  # seconds


class Bar:
    """A progress bar, or nothing if the user is not looking.

    Parameters
    ----------
    args : the parsed command line; `args.progress` is true, false, or `None` for "if a terminal".
    unit : what is counted.
    delay : seconds before the bar is first drawn.
    """

    def __init__(
        self, args: argparse.Namespace, unit: str = " steps", delay: float = _DELAY
    ) -> None:
        self._wanted = sys.stderr.isatty() if args.progress is None else args.progress
        self._unit, self._delay = unit, delay
        self._bar: Any = None

    def __call__(self, done: int, total: int, text: str) -> None:
        """Show `done` of `total`; both may start again, for a second stage.

        A stage whose `total` is 0 has no known length: only its text is shown, at once.
        """
        if not self._wanted:
            return
        if self._bar is None or total != self._bar.total or done < self._bar.n:
            self._start(total, text)
        self._bar.set_description(text, refresh=False)
        self._bar.update(done - self._bar.n)

    def _start(self, total: int, text: str) -> None:
        from tqdm import tqdm

        if self._bar is not None:
            self._bar.close()
        # where it cannot be redrawn in place, a line a second is plenty
        interval = 0.1 if sys.stderr.isatty() else 1.0
        size = _size()
        self._bar = tqdm(
            total=total, desc=text, unit=self._unit, delay=self._delay if total else 0,
            mininterval=interval, leave=False, file=sys.stderr, ncols=size[0], nrows=size[1],
            dynamic_ncols=size[0] is None,
            bar_format=None if total else "{desc} ...",
        )  # fmt: skip

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if self._bar is not None:
            self._bar.close()


def _size() -> tuple[int, int] | tuple[None, None]:
    """Columns and rows to draw in, or None for those of the terminal, which may change."""
    with contextlib.suppress(OSError, ValueError):
        if 0 in os.get_terminal_size(sys.stderr.fileno()):
            return _SIZE
    return None, None
