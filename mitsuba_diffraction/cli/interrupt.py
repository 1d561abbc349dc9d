"""Ctrl-C and SIGTERM end a command at once, even while Mitsuba holds the main thread.

Python runs its signal handlers on the main thread, between two of its own instructions. While a
scene loads that thread is in C++ for seconds, so a second one waits for the signal as well.
"""

from __future__ import annotations

import contextlib
import os
import signal
import socket
import sys
import threading
from collections.abc import Iterator

from ..atomic import remove_temporaries
from .console import say

INTERRUPTED = 130  # 128 + SIGINT, as shells report it
TERMINATED = 143  # 128 + SIGTERM
_CODES = {signal.SIGINT: INTERRUPTED, signal.SIGTERM: TERMINATED}

_NOTHING = "no half-written file was left behind"
_kept = _NOTHING  # of the running command, of which a process has one

#: Seconds in which the main thread may unwind by itself.
GRACE = 1.0


@contextlib.contextmanager
def ended_at_once() -> Iterator[None]:
    """Let a signal unwind the main thread inside, or end the process and its temporary files."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers
        return
    keep_in_mind(_NOTHING)
    reader, writer = socket.socketpair()
    writer.setblocking(False)
    left = threading.Event()
    watcher = threading.Thread(target=_watch, args=(reader, left), daemon=True)
    terminate = signal.signal(signal.SIGTERM, lambda *_: sys.exit(TERMINATED))
    interrupt = signal.getsignal(signal.SIGINT)
    wakeup = signal.set_wakeup_fd(writer.fileno(), warn_on_full_buffer=False)
    watcher.start()
    try:
        yield
    finally:
        left.set()
        signal.set_wakeup_fd(wakeup)
        signal.signal(signal.SIGTERM, terminate)
        writer.close()
        watcher.join()
        reader.close()
        signal.signal(signal.SIGINT, interrupt)


def keep_in_mind(kept: str) -> None:
    """Set the text on finished work with which an interruption ends this command, at any time."""
    global _kept
    _kept = kept


def say_interrupted() -> None:
    """Print the last line of an interrupted command, which another Ctrl-C does not cut short."""
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # `ended_at_once` restores it
    say(f"interrupted; {_kept}")


def _watch(reader: socket.socket, left: threading.Event) -> None:
    """Wait for signals; exit if the main thread has not left `GRACE` seconds after one."""
    interrupts = 0
    while received := reader.recv(1):
        number = signal.Signals(received[0])
        if number not in _CODES:
            continue
        if number == signal.SIGINT:
            interrupts += 1
            # a rendering has a handler of its own, which keeps the picture so far
            handled = signal.getsignal(signal.SIGINT) is not signal.default_int_handler
            if handled and interrupts == 1:
                continue
        if not left.wait(GRACE):
            remove_temporaries()
            if number == signal.SIGINT:
                say_interrupted()
            os._exit(_CODES[number])
