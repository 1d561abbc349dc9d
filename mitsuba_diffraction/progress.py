"""Progress callbacks of long work."""

from __future__ import annotations

from collections.abc import Callable

#: Called as progress(done, total, text); a total of 0 is not known yet.
Progress = Callable[[int, int, str], None]


def silent(done: int, total: int, text: str) -> None:
    """No-op progress callback."""
