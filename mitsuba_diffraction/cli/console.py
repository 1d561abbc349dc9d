"""What the command line says on stderr: one line per error and per warning."""

from __future__ import annotations

import contextlib
import re
import sys
import warnings
from collections.abc import Callable, Iterator

from ..errors import DiffractionWarning, one_line, shortened

PROGRAM = "mitsuba-diffraction"

# date, time, level, then the class, or the line of Python and its function
_STAMP = re.compile(r"^[\d-]+ [\d:]+ [A-Z]+\s+(?:\[[^]]*\]\s+)?(?:(?:<module>|\w+\(\)): )?")
# Mitsuba catches SIGINT while it renders, says so, and then lets Python have it.
_INTERRUPTED = "Received interrupt signal"
# Scalar variants say so of each, with its numbers.
_SAMPLE = re.compile(r"Invalid sample value: \[.*\]")
_SAMPLES = (
    "some samples are below zero, as colours outside of sRGB are, or no numbers; they are kept"
)


def say(text: str) -> None:
    """Print one line on stderr, above a progress bar if there is one."""
    line = f"{PROGRAM}: {shortened(one_line(text))}"
    if "tqdm" in sys.modules:
        from tqdm import tqdm

        tqdm.write(line, file=sys.stderr)
    else:
        print(line, file=sys.stderr, flush=True)


def say_error(text: str) -> None:
    """Print an error."""
    say(f"error: {text}")


def say_warning(text: str) -> None:
    """Print a warning."""
    say(f"warning: {text}")


@contextlib.contextmanager
def warnings_in_one_line() -> Iterator[None]:
    """Inside, every Python warning is printed as one line, a text that comes again only once."""
    say = saying_once()

    def show(message: Warning | str, category: type[Warning], *_: object) -> None:
        ours = issubclass(category, DiffractionWarning)
        say(str(message) if ours else f"{category.__name__}: {message}")

    with warnings.catch_warnings():
        warnings.simplefilter("always", DiffractionWarning)
        warnings.showwarning = show  # type: ignore[assignment]  # restored by catch_warnings
        yield


def saying_once() -> Callable[[str], None]:
    """A `say_warning` that says each text only once."""
    said: set[str] = set()

    def say(text: str) -> None:
        if text not in said:
            said.add(text)
            say_warning(text)

    return say


@contextlib.contextmanager
def mitsuba_warnings() -> Iterator[None]:
    """Inside, Mitsuba's warnings are printed like this program's, each once.

    A variant must be set.
    """
    import mitsuba as mi

    say = saying_once()

    class Lines(mi.Appender):
        def append(self, level: object, text: str) -> None:
            line = _without_stamp(text)
            if not line.startswith(_INTERRUPTED):  # whoever pressed Ctrl-C knows
                say(_SAMPLE.sub(_SAMPLES, line))

        def log_progress(self, *_: object) -> None:
            pass  # scalar variants draw bars of their own

    logger = mi.logger()
    before = [logger.appender(n) for n in range(logger.appender_count())]
    level = logger.log_level()
    logger.clear_appenders()
    logger.add_appender(Lines())
    logger.set_log_level(mi.LogLevel.Warn)
    try:
        yield
    finally:
        logger.clear_appenders()
        for appender in before:
            logger.add_appender(appender)
        logger.set_log_level(level)


def _without_stamp(text: str) -> str:
    """A line of Mitsuba's log without date, level and class."""
    return _STAMP.sub("", text.strip())
