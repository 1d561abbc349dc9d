"""Messages of the library, which name parameters and functions, in words of the command line."""

from __future__ import annotations

import argparse
import re

#: Functions that messages name, and the commands that call them.
_COMMANDS = {
    "DiffractionTable.build": "precompute", "read_orders": "solve --import",
    "solve_orders": "solve",
}  # fmt: skip
#: A function, and its arguments if the message gives some.
_CALL = re.compile(
    rf"\b({'|'.join(map(re.escape, _COMMANDS))})\b(?:\(((?:\w+=(?:\([^()]*\)|[^,()]*)(?:, )?)+)\))?"
)
_ARGUMENT = re.compile(r"(\w+)=(\([^()]*\)|[^,()]*)")
_WORDS = {"the command '": "'mitsuba-diffraction ", "material:": "--material "}
#: Parameters that remedies in messages name.
_REMEDIES = (
    "accept", "channel", "coherence_width", "crop", "fill", "height_unit", "level", "max_height",
    "method", "patch", "periodic", "pixel_size", "polarised", "turn", "windows",
)  # fmt: skip
_REMEDY = re.compile(rf"(?<!-D )\b({'|'.join(_REMEDIES)})=(\w++(?:[.+-]\w++)*+)(?! \()")
#: Options that are not called after their parameters.
_OPTIONS = {"method": "--solver"}
_options: set[str] = set()


def speak_for(parser: argparse.ArgumentParser) -> None:
    """Let `worded` name the options of this command from now on."""
    _options.clear()
    _options.update(word for action in parser._actions for word in action.option_strings)


def worded(text: str) -> str:
    """Return a message with the command's option beside each parameter, and commands' names."""

    def with_option(match: re.Match[str]) -> str:
        name, value = match.groups()
        option = _option(name, value)
        if option.split()[0] in _options:
            return f"{match[0]} ({option})"
        return f"{match[0]} (-D {match[0]})" if "-D" in _options else match[0]

    for phrase, words in _WORDS.items():
        text = text.replace(phrase, words)
    return _REMEDY.sub(with_option, _CALL.sub(_command, text))


def _command(match: re.Match[str]) -> str:
    """Return the command that calls a function with these arguments."""
    options = [_option(*pair) for pair in _ARGUMENT.findall(match[2] or "")]
    return f"'{' '.join(['mitsuba-diffraction', _COMMANDS[match[1]], *options])}'"


def _option(name: str, value: str) -> str:
    """Return a parameter and its value as an option; lists are words, and True is a flag."""
    option = _OPTIONS.get(name, f"--{name.replace('_', '-')}")
    return option if value == "True" else f"{option} {value.strip('()').replace(',', '')}"
