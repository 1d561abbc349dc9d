"""Messages of the library, which name parameters and functions, in words of the command line."""

from __future__ import annotations

import argparse
import re

#: Functions that messages name, and the commands that call them.
_COMMANDS = {"DiffractionTable.build": "'mitsuba-diffraction precompute'"}
#: Parameters with which messages say what to do.
_REMEDIES = (
    "channel", "coherence_width", "crop", "fill", "height_unit", "level", "max_height", "periodic",
    "pixel_size", "windows",
)  # fmt: skip
_REMEDY = re.compile(rf"(?<!-D )\b({'|'.join(_REMEDIES)})=(\w++(?:[.+-]\w++)*+)(?! \()")
_options: set[str] = set()


def speak_for(parser: argparse.ArgumentParser) -> None:
    """Let `worded` name the options of this command from now on."""
    _options.clear()
    _options.update(word for action in parser._actions for word in action.option_strings)


def worded(text: str) -> str:
    """Return a message with the command's option beside each parameter, and commands' names."""

    def with_option(match: re.Match[str]) -> str:
        name, value = match.groups()
        option = f"--{name.replace('_', '-')}"
        if option in _options:
            return f"{match[0]} ({option} {value})"
        return f"{match[0]} (-D {match[0]})" if "-D" in _options else match[0]

    for function, command in _COMMANDS.items():
        text = text.replace(function, command)
    return _REMEDY.sub(with_option, text)
