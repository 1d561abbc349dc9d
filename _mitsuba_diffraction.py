"""Entry point of the command: quiet on Ctrl-C even while the package is being imported.

Outside of the package, since importing any of its modules imports Mitsuba first.
"""

from __future__ import annotations

import io
import os
import signal
import sys
from types import FrameType


def _leave(number: int, frame: FrameType | None) -> None:
    """Exit without unwinding: an exception within the import of an extension would abort."""
    os.write(2, b"mitsuba-diffraction: interrupted\n")
    os._exit(128 + number)


def leave_quietly() -> None:
    """From now on Ctrl-C is one line, until `main` has imported what answers it."""
    # unless it is ignored, as in the background of a shell
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)


def main() -> int:
    """Run the command, and return its exit code."""
    leave_quietly()
    for stream in (sys.stdout, sys.stderr):
        # lines hold µ and κ, which the code pages of Windows and the C locale lack
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8")
    try:
        from mitsuba_diffraction.cli import main as command
    except NameError as error:
        # Dr.Jit raises it while it handles the error of a missing library of the system
        if not isinstance(error.__context__, ImportError):
            raise
        sys.exit(
            f"mitsuba-diffraction: error: Dr.Jit cannot be loaded: {error.__context__}; install "
            "that library (on Debian and Ubuntu: apt install libatomic1 libllvm19)"
        )

    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return command()


if __name__ == "__main__":
    sys.exit(main())
