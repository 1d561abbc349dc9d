"""Entry point of the command: quiet on Ctrl-C even while the package is being imported.

Outside of the package, since importing any of its modules imports Mitsuba first.
"""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType


def _leave(number: int, frame: FrameType | None) -> None:
    """Exit without unwinding: an exception within the import of an extension would abort."""
    os.write(2, b"mitsuba-diffraction: interrupted\n")
    os._exit(128 + number)


def main() -> int:
    """Run the command, and return its exit code."""
    handled = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if handled:  # and not ignored, as in the background of a shell
        signal.signal(signal.SIGINT, _leave)
    from mitsuba_diffraction.cli import main as command

    if handled:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return command()


if __name__ == "__main__":
    sys.exit(main())
