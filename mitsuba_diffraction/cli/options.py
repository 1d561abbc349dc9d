"""Commands, declared by `command`, and options that several share.

Options are rows of values; the functions beside them read the given values.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import DiffractionError
from ..heights import HeightField, LoadOptions, Source, units_warning
from ..heights.coherence import resolved
from ..heights.read import BY_DEFAULT, OPTIONS
from ..heights.source import notes_line
from ..optics.display import VIEWS
from ..retired import REPLACED
from ..settings import SETTINGS, TableSettings, checked
from ..tables.build.checks import check_units, check_window, warnings_of
from ..thesis.methods import NAMES
from .report import Figures
from .values import NUMBERS, limits, path_ending_in, whole_number

#: The values that `add_option` takes after the group.
Row = tuple[Any, ...]

#: Limits of spectra from heights, for help and descriptions.
LIMITS = (
    "The model is light that one surface diffracts. Layers (beetles, butterflies' laminae, "
    "feathers, nacre, iridophores), volumes (pigment cells, spongy keratin) and structures deeper "
    "than a wavelength or steeper than 45° are not in a scan of heights. Where they make the "
    "colour, measure the layers and use a multilayer or FDTD program; deep gratings: "
    "'mitsuba-diffraction solve'."
)

#: Names of the options for reading heights.
HEIGHTS = tuple(OPTIONS)
#: Settings of a table.
TABLE = (
    "coherence_width", "coherence", "basis", "tolerance", "terms", "taps", "height_scale_max",
    "windows",
)  # fmt: skip

#: The settings of a table that the evaluators of the thesis take.
TABLE_NAMES = ("coherence_width", "coherence", "tolerance", "terms")


# Options that a method of the thesis does not use.
_UNUSED: dict[str, tuple[str, ...]] = {
    "spectral": ("period", "terms"), "flss": ("period",), "nmm": (),
    "pq": ("period", "coherence"), "pq-sinc": ("period", "coherence"),
    "rainbow": ("coherence", "tolerance", "terms", "step"),
}  # fmt: skip

# Names that every command has.
_GENERAL = ("command", "json", "debug", "progress")

#: A patch, which `load_patch` reads.
SOURCE = ("SOURCE", "heights of any format, or a recipe (.toml)", Path)
#: Options for reading heights by names of files; `analysis.treatments`.
TREATMENTS = (
    "--treatments FILE", 'TOML: a table of options for each pattern of names, ["snakes/*.png"]; '
    "options on the command line override it", Path,
)  # fmt: skip
#: Mitsuba's variant.
MODE = (
    "-m --mode VARIANT", "Mitsuba variant; default: cuda_ad_spectral with a GPU, else "
    "llvm_ad_spectral",
)  # fmt: skip
#: View by which a picture's linear light is shown.
VIEW = (
    "--tonemap", "natural keeps hues and turns bright light white; standard clips each channel by "
    "itself", VIEWS, "natural", {"dest": "view"},
)  # fmt: skip


def _option(name: str) -> str:
    return f"--{name.replace('_', '-')}"


@dataclass(frozen=True)
class Group:
    """Options with a title of their own in --help; without a title at most one may be given."""

    title: str
    rows: tuple[Row | Group, ...]
    text: str | None = None


@dataclass
class Command:
    """Sub-command: its function, which `main` calls with the arguments, and its options."""

    run: Callable[[argparse.Namespace], Figures]
    name: str
    help: str
    description: str
    rows: tuple[Row | Group, ...]

    def add_to(self, subparsers: argparse._SubParsersAction[Any]) -> None:
        """Add the parser of the command."""
        parser = subparsers.add_parser(self.name, help=self.help, description=self.description)
        parser.set_defaults(run=lambda args: self.run(args), parser=parser)
        add_options(parser, *self.rows)


def command(
    name: str, help: str, description: str, *rows: Row | Group
) -> Callable[[Callable[[argparse.Namespace], Figures]], Command]:
    """Declare a function as a sub-command."""
    return lambda run: Command(run, name, help, description, rows)


def add_options(group: argparse._ActionsContainer, *rows: Row | Group) -> None:
    """Add options or arguments, and groups of them."""
    for row in rows:
        if not isinstance(row, Group):
            add_option(group, *row)
        elif row.title:
            add_options(group.add_argument_group(row.title, row.text), *row.rows)
        else:
            add_options(group.add_mutually_exclusive_group(), *row.rows)


def add_option(
    group: argparse._ActionsContainer, usage: str, text: str, kind: Any = None, default: Any = None,
    more: Mapping[str, Any] = {},
) -> None:  # fmt: skip
    """Add an option, or an argument.

    usage : names of the option and of its value, such as "-s --spp N"; "..." if there may be many.
    text : help; the default value is told at its end, unless the text tells a default.
    kind : type of a value; a tuple of choices; bool of a flag; or, of an option that may be given
        several times, a list of the type.
    more : further keywords of `argparse.ArgumentParser.add_argument`.
    """
    words = usage.split()
    names = [word for word in words if word.startswith("-")]
    values = words[len(names) :]
    how: dict[str, Any] = {"help": text}
    if not names:
        how["dest"] = values[0].lower()
    if values:
        how["metavar"] = values[0]
    if values[1:] == ["..."]:
        how["nargs"] = "+"
    if kind is bool:
        how["action"] = "store_true"
    elif isinstance(kind, list):
        how |= {"action": "append", "type": kind[0], "default": []}
    elif kind is not None:  # BooleanOptionalAction takes no type, not even None
        how["choices" if isinstance(kind, tuple) else "type"] = NUMBERS.get(kind, kind)
    if default is not None:
        how["default"] = default
    if default is not None and "default:" not in text:
        shown = f"{default:g}" if isinstance(default, (int, float)) else default
        how["help"] = f"{text}; default: {shown}".removeprefix("; ")
    group.add_argument(*names, **{**how, **more})


def retired_row(name: str, kind: type | None = None) -> Row:
    """Return the row of an option of an earlier version, which `retired` names; bool of a flag."""
    return _option(name), argparse.SUPPRESS, kind


def given(args: argparse.Namespace, names: Iterable[str]) -> dict[str, Any]:
    """Return the values of options that are on the command line, by name."""
    return {name: getattr(args, name) for name in names if name in args.given}


def option_of(args: argparse.Namespace, name: str) -> str:
    """Return the option, or the file's placeholder, whose value has this name in `args`."""
    action = next(action for action in args.parser._actions if action.dest == name)
    return str(action.option_strings[-1] if action.option_strings else action.metavar)


def flags_of(parser: argparse.ArgumentParser) -> dict[str, str]:
    """Return the options of a parser by the names of their values."""
    return {each.dest: each.option_strings[-1] for each in parser._actions if each.option_strings}


def refuse(args: argparse.Namespace, names: Iterable[str], why: str) -> None:
    """Refuse the first of the options that is on the command line, with a usage error.

    why : the message after the option.
    """
    for name in given(args, names):
        args.parser.error(f"argument {option_of(args, name)}{why}")


def refuse_others(args: argparse.Namespace, names: Iterable[str], why: str) -> None:
    """Refuse the first option or argument beside these and the general ones, as `refuse` does."""
    refuse(args, sorted(args.given - {*_GENERAL, *REPLACED, *names}), why)


def refuse_of_table(args: argparse.Namespace, shown: Path | str, names: Iterable[str]) -> None:
    """Refuse the first option whose value a table has in itself, with a DiffractionError.

    shown : the table's file, or a preset's name.
    """
    for name in given(args, names):
        raise DiffractionError(
            f"'{shown}' is a table, which has its own; leave {option_of(args, name)} out, or give "
            "heights"
        )


def heights() -> Group:
    """Return the options for reading a file of heights; `load_options` checks their values."""
    rows = ((f"{_option(name)} {each.metavar}", each.help) for name, each in OPTIONS.items())
    return Group("reading heights", tuple(rows))


def load_options(args: argparse.Namespace) -> LoadOptions:
    """Return the options for reading heights, as `HeightField.load` takes them.

    Raises a DiffractionError if a value does not fit.
    """
    return LoadOptions.parse(**{name: getattr(args, name) for name in OPTIONS})


def files(kinds: str, nargs: str = "+") -> Row:
    """Return the row of FILE..., files of these kinds; `analysis.repeats.scan_files` reads it."""
    text = f"{kinds}; folders and patterns of names, too"
    return "FILE", text, Path, None, {"dest": "files", "nargs": nargs}


def table(names: Sequence[str] = TABLE, **defaults: str) -> Iterator[Row]:
    """Yield rows of a table's settings. defaults: texts for the help in place of the defaults."""
    for name in names:
        item = SETTINGS[name]
        kind: Any = item.choices or (whole_number(1) if item.type is int else item.type)
        values = (item.metavar,) if isinstance(item.metavar, str) else ()
        if isinstance(item.metavar, tuple):
            kind, values = limits, (":".join(item.metavar),)
        default = defaults.get(name, item.default_text)
        yield " ".join([_option(name), *values]), f"{item.help}; default: {default}", kind


def table_options(
    args: argparse.Namespace, names: Sequence[str] = (*TABLE, "wavelength_range")
) -> dict[str, Any]:
    """Return the settings of a table that are on the command line, by name.

    names : of the settings that the command has for the table.

    Raises a DiffractionError if a value is not allowed.
    """
    return {name: checked(name, value) for name, value in given(args, names).items()}


def direction(theta: float = 0.0, phi: float | None = 0.0) -> tuple[Row, Row]:
    """Return the rows of the light's direction; without `phi` it is across the patch's grooves."""
    azimuth = "azimuth of the light from x towards y, degrees"
    if phi is None:
        azimuth += "; default: across the grooves if there are any, or 0"
    return (
        ("--theta DEG", "angle of the light from the normal, 0 to below 90", float, theta),
        ("--phi DEG", azimuth, float, phi),
    )


#: Limits of the spectrum and its step, nm.
SPECTRUM = (
    *((*row, TableSettings.wavelength_range) for row in table(("wavelength_range",))),
    ("--step NM", "between wavelengths", float, 5.0),
)


def method(default: str | None, text: str) -> tuple[Row, Row]:
    """Return the rows of the method that sums the spectrum, and of the period that some need."""
    period = "µm, for the methods that need one; default: estimated from the heights"
    return ("--method", text, NAMES, default), ("--period D", period, float)


def refuse_unused(args: argparse.Namespace, used: Iterable[str] = ()) -> None:
    """Refuse options that have no effect with --method, but for those that the command uses."""
    names = [name for name in _UNUSED[args.method] if name not in used]
    refuse(args, names, f": has no effect with --method {args.method}; leave it out")


def samples(least: int, default: int | None) -> tuple[Row, Row]:
    """Return the rows of samples per pixel and of the seed of their random numbers."""
    own = "; default: the scene's" if default is None else ""
    return (
        ("-s --spp N", f"samples per pixel{own}", whole_number(least), default),
        ("--seed N", "seed of the random numbers", whole_number(0), 0),
    )


def json(content: str = "the figures", **more: Any) -> Row:
    """Return the row of a file for the figures; `main` checks that it can be written."""
    return "--json FILE", f"write {content} as JSON", path_ending_in(".json"), None, more


def load_patch(args: argparse.Namespace) -> tuple[HeightField, dict[str, Any]]:
    """Return the heights of `args.source`, and settings of tables: a recipe's and then options.

    Raises a DiffractionError if the source is a table or no heights, or an option does not fit.
    """
    source = Source.of(args.source, load_options(args))
    settings = {**source.settings, **table_options(args)}
    return source.field(), {name: settings[name] for name in TABLE_NAMES if name in settings}


def level_of(args: argparse.Namespace) -> str | None:
    """Return the surface to subtract that the command line or a recipe names, or None."""
    return Source.of(args.source, load_options(args)).options.level


def table_warnings(fields: Sequence[HeightField], settings: TableSettings) -> list[str]:
    """List the warnings of a table of these heights, and its refusal if size alone decides."""
    how = resolved(settings, fields)
    try:
        check_units(fields)
        check_window(fields[0], how)
    except DiffractionError as error:
        doubts = [line for field in fields for line in field.validity(settings.wavelength_range)]
        asked = {units for field in fields if (units := units_warning(field))}
        asked = {units for units in asked if units in str(error)}  # and need not be asked twice
        others = [line for line in doubts if not any(units in line for units in asked)]
        return [*others, f"{fields[0].name}: {error}"]
    return warnings_of(fields, settings)


def notes(args: argparse.Namespace, field: HeightField, settings: TableSettings) -> str:
    """Return a line on the number of notes on heights and the command that prints them, or ""."""
    lines = [line for line in field.history if line.endswith(BY_DEFAULT)]
    lines += table_warnings([field], settings)
    return notes_line(lines, args.source, load_options(args), settings)
