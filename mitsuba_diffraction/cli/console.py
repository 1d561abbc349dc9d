"""What the command line says on stderr: one line per error and per warning."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Callable, Iterator

from ..errors import DiffractionWarning

PROGRAM = "mitsuba-diffraction"


def one_line(text: str) -> str:
    """The text with every run of white space, line ends included, made one blank."""
    return " ".join(text.split())


def say(text: str) -> None:
    """Print one line on stderr, above a progress bar if there is one."""
    line = f"{PROGRAM}: {one_line(text)}"
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
