"""Native libraries print what goes wrong, past Python: one clear line needs their lines caught."""

from __future__ import annotations

import contextlib
import io
import os
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass

_STDERR = 2


@dataclass
class Messages:
    """What a native library printed."""

    text: str = ""

    def last_reason(self) -> str:
        """The last line, without the path in front of it; "" if nothing was printed."""
        lines = [line for line in self.text.splitlines() if line.strip()]
        return lines[-1].split(": ", 1)[-1].strip()[:200] if lines else ""


@contextlib.contextmanager
def native_messages() -> Iterator[Messages]:
    """Catch what is printed to standard output and error inside, by C and C++ code too.

    OpenEXR and libtiff report damaged files there, and offer no other way in Python. If nothing is
    raised inside, what was printed is passed on, so that no other thread's line is lost.
    """
    messages = Messages()
    printed = io.StringIO()
    with contextlib.ExitStack() as cleanup:
        # Without a standard error, or room for a temporary file, messages stay uncaught.
        with contextlib.suppress(OSError):
            caught = cleanup.enter_context(tempfile.TemporaryFile())
            original = os.dup(_STDERR)
            os.dup2(caught.fileno(), _STDERR)
            cleanup.callback(_give_back, original, caught, messages)
        with contextlib.redirect_stdout(printed):
            yield messages
    print(printed.getvalue(), end="")
    print(messages.text, end="", file=sys.stderr)


def _give_back(original: int, caught: io.BufferedRandom, messages: Messages) -> None:
    os.dup2(original, _STDERR)
    os.close(original)
    caught.seek(0)
    messages.text = caught.read().decode(errors="replace")
