"""Lines of the command line on stderr: errors, warnings, progress bars."""

from __future__ import annotations

import argparse
import contextlib
import functools
import os
import re
import sys
import threading
import warnings
from collections.abc import Iterator, Mapping
from typing import Any, Self

import mitsuba as mi

from ..errors import DiffractionWarning, one_line, shortened
from ..progress import showing

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

# Parameter of Python in a message, but not of a scene (-D) or of one layer.
_PARAMETER = re.compile(
    r"(?<![^\s(])(?<!-D )(?<!layer \d: )(?<!layer \d\d: )([a-z]\w*)(=True\b|=(?=\S)|(?![\w=(.']))"
)
_flags: Mapping[str, str] = {}  # of the running command, of which a process has one

# Columns and rows of a terminal that reports no size, as in some containers and editors.
_SIZE = 80, 24

# Below it a bar would only flash by.
_DELAY = 0.5  # seconds

#: Seconds between lines on progress where there is no terminal.
EVERY = 10.0


def name_flags(flags: Mapping[str, str]) -> None:
    """Set the command's options by the names of their values, for `flagged`."""
    global _flags
    _flags = flags


def flagged(text: str) -> str:
    """Return a message with options of the running command in place of parameters of Python.

    "pixel_size=0.1" becomes "--pixel-size 0.1"; behind the name of a TOML file stand its keys.
    """

    def option(parameter: re.Match[str]) -> str:
        name, value = parameter.groups()
        ahead, behind = before[: parameter.start()], before[parameter.end() :]
        first = behind.startswith(": ") and ahead in ("", "error: ", "warning: ")
        if name not in _flags or not (value or "_" in name or first):
            return parameter[0]
        return f"{_flags[name]} " if value == "=" else _flags[name]

    before, *keys = text.partition(".toml'")
    return _PARAMETER.sub(option, before) + "".join(keys)


def say(text: str) -> None:
    """Print one line on stderr, above a progress bar if there is one."""
    line = f"{PROGRAM}: {shortened(one_line(flagged(text)))}"
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
    """Print each warning inside, Python's or Mitsuba's, as one line, and each text only once."""
    say = functools.cache(say_warning)

    def show(message: Warning | str, category: type[Warning], *_: object) -> None:
        ours = issubclass(category, DiffractionWarning)
        say(str(message) if ours else f"{category.__name__}: {message}")

    class Lines(mi.Appender):
        def append(self, level: object, text: str) -> None:
            line = _STAMP.sub("", text.strip())
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
        with warnings.catch_warnings():
            warnings.simplefilter("always", DiffractionWarning)
            warnings.showwarning = show  # type: ignore[assignment]  # restored by catch_warnings
            yield
    finally:
        logger.clear_appenders()
        for appender in before:
            logger.add_appender(appender)
        logger.set_log_level(level)


class Bar:
    """Progress bar on a terminal; elsewhere a line every `EVERY` seconds.

    args : the parsed command line; `args.progress` is true or false for a bar always or nothing.
    delay : seconds before the bar is first drawn.
    """

    def __init__(
        self, args: argparse.Namespace, unit: str = " steps", delay: float = _DELAY
    ) -> None:
        self._wanted = sys.stderr.isatty() if args.progress is None else args.progress
        self._unit, self._delay = unit, delay
        self._bar: Any = None
        self._in_lines = args.progress is None and not self._wanted
        self._state, self._over = "working", threading.Event()
        self._loading = showing(self._show_loading)

    def __call__(self, done: int, total: int, text: str) -> None:
        """Show `done` of `total`; both may start again for a second stage.

        A stage whose `total` is 0 has no known length: only its text is shown, at once.
        """
        part = f", {done} of {total}{self._unit} ({done / total:.0%})" if total else ""
        self._state = f"{text}{part}"
        if not self._wanted:
            return
        if self._bar is None or total != self._bar.total or done < self._bar.n:
            self._start(total, text)
        self._bar.set_description(text, refresh=False)
        self._bar.update(done - self._bar.n)

    def _show_loading(self, done: int, total: int, text: str) -> None:
        """Show what a BSDF does while it loads; the count of an animation's frames stays."""
        text = f"{text}, {done} of {total}" if total > 1 else text
        if self._bar is None or not self._bar.total:
            self(0, 0, text)
        else:
            self._state = text
            self._bar.set_description(text)

    def _say_regularly(self) -> None:
        """Say how far the work is, until it ends."""
        seconds = 0.0
        while not self._over.wait(EVERY):
            seconds += EVERY
            say(f"{self._state}, after {seconds:g} s")

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
        if self._in_lines:
            threading.Thread(target=self._say_regularly, daemon=True).start()
        self._loading.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        self._loading.__exit__(None, None, None)
        self._over.set()
        if self._bar is not None:
            self._bar.close()


def _size() -> tuple[int, int] | tuple[None, None]:
    """Return the columns and rows to draw in; None follows the terminal's size."""
    with contextlib.suppress(OSError, ValueError):
        if 0 in os.get_terminal_size(sys.stderr.fileno()):
            return _SIZE
    return None, None
