"""Entry point of the command: one line for Ctrl-C and for failing imports of the package.

Outside of the package: its commands import Mitsuba, which may fail or be interrupted.
"""

from __future__ import annotations

import io
import os
import signal
import sys
from types import FrameType, TracebackType


def _leave(number: int, frame: FrameType | None) -> None:
    """Exit without unwinding: an exception within the import of an extension would abort."""
    os.write(2, b"mitsuba-diffraction: interrupted\n")
    os._exit(128 + number)


def _refuse(text: str) -> None:
    """Print an error and exit without unwinding: extensions that failed to load abort at exit."""
    line = " ".join(f"mitsuba-diffraction: error: {text}".split())
    os.write(2, f"{line}\n".encode("utf-8", "replace"))
    os._exit(1)


def _explain(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    """Print an exception of the package's import in one line, and exit."""
    # Dr.Jit raises NameError while it handles the error of a missing library of the system
    cause = error.__context__ if isinstance(error, NameError) else error
    if isinstance(cause, ImportError) and "drjit" in str(cause) + str(error):
        _refuse(
            f"Dr.Jit cannot be loaded: {cause}; install that library (on Debian and Ubuntu: apt "
            "install libatomic1 libllvm19)"
        )
    if isinstance(cause, (ImportError, MemoryError, OSError)):
        _refuse(
            f"the program cannot be loaded: {cause or 'out of memory'}; is the installation "
            "complete, and is there enough memory (ulimit -v)?"
        )
    sys.__excepthook__(kind, error, trace)


def prepare() -> None:
    """Open closed streams, check the working folder, and answer Ctrl-C and failing imports."""
    for number in (0, 1, 2):  # else the next file opened would take the number, and our output
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    sys.stdout = sys.stdout or open(1, "w", closefd=False)  # noqa: SIM115  # None if closed
    sys.stderr = sys.stderr or open(2, "w", closefd=False)  # noqa: SIM115
    try:
        os.getcwd()  # Mitsuba aborts without one
    except OSError:
        _refuse("the current folder does not exist any more; change to another (cd)")
    sys.excepthook = _explain
    # unless it is ignored, as in the background of a shell
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, _leave)


def main() -> int:
    """Run the command, and return its exit code."""
    prepare()
    # A command's own threads share the cores; OpenBLAS' threads would spin beside them
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    for stream in (sys.stdout, sys.stderr):
        # lines hold µ and κ, which the code pages of Windows and the C locale lack
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(encoding="utf-8")
    from mitsuba_diffraction.cli import main as command

    sys.excepthook = sys.__excepthook__
    if signal.getsignal(signal.SIGINT) is _leave:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    return command()


if __name__ == "__main__":
    sys.exit(main())
