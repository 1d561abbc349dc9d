"""Silence for libraries that print about damaged files, which our own errors report in one line.

A process's streams belong to its program. The package leaves them alone, unless the program is its
own command line.
"""

from __future__ import annotations

import contextlib
import ctypes
import os
import sys
import threading
from collections.abc import Iterator
from typing import Any, TextIO

from .errors import printable

_one_at_a_time = threading.Lock()
_programs = 0


class _Printable:
    """Text stream in which nothing controls the terminal: names and headers come from anywhere."""

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream

    def write(self, text: str) -> int:
        return self._stream.write(printable(text))

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextlib.contextmanager
def own_program() -> Iterator[None]:
    """Mark the streams of the process as ours inside: `without_chatter` keeps them clean.

    Text for stdout is made `printable`.
    """
    global _programs
    _programs += 1
    try:
        with contextlib.redirect_stdout(_Printable(sys.stdout)):
            yield
    finally:
        _programs -= 1


@contextlib.contextmanager
def without_chatter() -> Iterator[None]:
    """Let nothing reach stdout or stderr inside, in a program of ours; elsewhere do nothing."""
    if not _programs:
        yield
        return
    with _one_at_a_time:
        _flush()
        kept = [(number, os.dup(number)) for number in (1, 2)]
        try:
            with open(os.devnull, "w") as nowhere:
                for number, _ in kept:
                    os.dup2(nowhere.fileno(), number)
                with contextlib.redirect_stdout(nowhere):  # OpenEXR has Python print, too
                    yield
        finally:
            _flush()
            for number, copy in kept:
                os.dup2(copy, number)
                os.close(copy)


def _flush() -> None:
    """Flush the buffers of Python and of C."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):  # a pipe that nobody reads, or closed
            stream.flush()
    # on Windows the C library that all extensions of Python share
    ctypes.CDLL("ucrtbase" if sys.platform == "win32" else None).fflush(None)
