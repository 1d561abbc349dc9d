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

_one_at_a_time = threading.Lock()
_programs = 0


@contextlib.contextmanager
def own_program() -> Iterator[None]:
    """Mark the streams of the process as ours inside: `without_chatter` keeps them clean."""
    global _programs
    _programs += 1
    try:
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
