"""Parser of the command line, and the boundary at which every error becomes one line.

A sub-command is a function that `options.command` declares. It returns its figures, for --json, and
sets `args.code` to end with another exit code than 0. What takes long to load it imports when
called (Matplotlib and SciPy's larger parts above all), so that `--help` answers soon.
"""

from __future__ import annotations

import argparse
import contextlib
import functools
import os
import re
import sys
import time
import traceback
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn

from ..errors import DiffractionError, printable, shortened
from ..files import check_name
from ..inputs import noted
from ..retired import retired
from ..streams import own_program
from . import (
    brdf_map,
    evaluate,
    export_bsdf,
    export_osl,
    hologram,
    info,
    orders,
    plan,
    precompute,
    presets,
    realtime,
    render,
    scatter,
    solve,
    spectrum,
    survey,
    sweep,
    tangents,
    tonemap,
    tradeoff,
)
from .arguments import note_arguments
from .console import PROGRAM, name_flags, say_error, warnings_in_one_line
from .interrupt import INTERRUPTED, ended_at_once, say_interrupted
from .options import flags_of
from .report import STDOUT, check_outputs, save_json
from .spellings import current

#: The sub-commands, in the order of --help.
COMMANDS = (
    precompute.run, solve.run, orders.run, info.run, tangents.run, presets.run, hologram.run,
    plan.run, render.run, tonemap.run, brdf_map.run, spectrum.run, evaluate.run, survey.run,
    scatter.run, sweep.run, tradeoff.run, realtime.compare, realtime.view, realtime.export_viewer,
    realtime.export_shader, export_osl.run, export_bsdf.run,
)  # fmt: skip

DONE = 0
FAILED = 1
USAGE = 2


class Parser(argparse.ArgumentParser):
    """Argument parser whose errors are one line, with the values that they quote shortened.

    Ranges may begin with a minus: -60:60:5 is a range. The result's `given` has the names of all
    options and arguments on the command line, for `options.given`.
    """

    def __init__(self, **how: Any) -> None:
        super().__init__(**how)
        self._negative_number_matcher = re.compile(r"^-[\d.]+([:,]-?[\d.]+)*$")

    def parse_known_args(self, *words: Any, **more: Any) -> Any:
        """Parse; a command's names are kept."""
        self._given: set[str] = set()
        args, rest = super().parse_known_args(*words, **more)
        args.given = self._given | getattr(args, "given", set())
        return args, rest

    def _get_values(self, action: argparse.Action, texts: list[str]) -> Any:
        if texts or action.option_strings:
            self._given.add(action.dest)
        return super()._get_values(action, texts)

    def error(self, message: str) -> NoReturn:
        line = shortened(printable(message))
        self.exit(USAGE, f"{self.prog}: error: {line}; options: '{self.prog} --help'\n")


@noted()
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code: 0 done, 1 failed, 2 usage, 130 Ctrl-C."""
    try:
        words = list(sys.argv[1:] if argv is None else argv)
        for text in words:
            check_name(text)
        args, unknown = build_parser().parse_known_args(current(words))
        # parameters of a scene, -D, have names of Python
        name_flags({} if "parameters" in args else args.flags | flags_of(args.parser))
        if unknown:  # of the command, whose usage helps
            args.parser.error(f"unrecognized arguments: {' '.join(unknown)}")
    except DiffractionError as error:
        say_error(str(error))
        return FAILED
    except SystemExit as stop:  # argparse: --help, --version and usage errors
        return _code_of(stop)
    except KeyboardInterrupt:
        with ended_at_once():
            say_interrupted()
        return INTERRUPTED
    with own_program(), warnings_in_one_line(), ended_at_once():
        return _run(args)


@functools.cache
def build_parser() -> argparse.ArgumentParser:
    """Build the parser with all sub-commands, once: commands leave its defaults as they are."""
    parser = Parser(
        prog=PROGRAM, description="Diffraction of measured height fields, for Mitsuba 3."
    )
    _add_common(parser)
    parser.set_defaults(debug=False, progress=None, json=None)
    parser.add_argument(
        "--version", action="version", version=f"{PROGRAM} {version('mitsuba_diffraction')}"
    )
    subparsers = parser.add_subparsers(
        title="commands", metavar="COMMAND", dest="command", required=True
    )
    for command in COMMANDS:
        command.add_to(subparsers)
    # of tables, which messages may want made again
    flags = {
        name: f"{maker} {flag}"
        for maker in ("precompute", "solve")
        for name, flag in flags_of(subparsers.choices[maker]).items()
    }
    parser.set_defaults(flags=flags)
    for subparser in subparsers.choices.values():
        _add_common(subparser.add_argument_group("general"))
    return parser


def _add_common(group: argparse._ActionsContainer) -> None:
    """Add the options that may stand before or after the name of the sub-command.

    They have no defaults, which would override values given before the name.
    """
    group.add_argument(
        "--debug",
        action="store_true",
        default=argparse.SUPPRESS,
        help="show the traceback of an error",
    )
    group.add_argument(
        "--progress",
        action=argparse.BooleanOptionalAction,
        default=argparse.SUPPRESS,
        help="show progress bars, or nothing; by default bars on a terminal, else a line every ten "
        "seconds",
    )


def _run(args: argparse.Namespace) -> int:
    _load_matplotlib()
    try:
        note_arguments(args)
        report = [args.json] if args.json not in (None, STDOUT) else []
        check_outputs(report)
        retired(sorted(args.given))
        args.began, args.code = time.perf_counter(), DONE
        figures = args.run(args)
        for file in report if figures else []:
            save_json(file, figures)
        sys.stdout.flush()
        code: int = args.code
        return code
    except SystemExit as stop:  # args.parser.error of a sub-command
        return _code_of(stop)
    except DiffractionError as error:
        return _fail(error, str(error), args.debug)
    except KeyboardInterrupt:
        say_interrupted()
        return INTERRUPTED
    except BrokenPipeError:
        # whoever read our output has enough; Python must not try to flush the rest at exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except MemoryError as error:
        return _fail(error, "out of memory; use a smaller input or free some", args.debug)
    except OSError as error:
        where = f" '{error.filename}'" if error.filename else ""
        return _fail(error, f"{error.strerror or error}{where}", args.debug)
    except Exception as error:
        if _interrupted(error):
            say_interrupted()
            return INTERRUPTED
        text = f"unexpected {type(error).__name__}: {error}"
        if not args.debug:
            text += "; run it again with --debug for the traceback, and please report it"
        return _fail(error, text, args.debug)


def _interrupted(error: Exception) -> bool:
    """Say whether Ctrl-C is the cause: extensions that it ends while they load raise own errors."""
    cause: BaseException | None = error
    while cause is not None and not isinstance(cause, KeyboardInterrupt):
        cause = cause.__cause__ or cause.__context__
    return cause is not None


def _load_matplotlib() -> None:
    """Import Matplotlib without the settings of the current folder.

    Its `matplotlibrc` may make LaTeX run a program of the folder's, for every text of a figure.
    """
    if os.path.lexists("matplotlibrc"):
        with contextlib.chdir(Path(__file__).parent):
            import matplotlib  # noqa: F401


def _fail(error: Exception, text: str, debug: bool) -> int:
    if debug:
        traceback.print_exception(error)
    say_error(text)
    return FAILED


def _code_of(stop: SystemExit) -> int:
    return stop.code if isinstance(stop.code, int) else FAILED
