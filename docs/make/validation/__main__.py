"""Solve gratings rigorously, and write the pages that compare the model with the solutions.

python -m docs.make.validation report -o docs
python -m docs.make.validation solve perfect      # minutes to an hour; extra `validation`
python -m docs.make.validation report gratings    # one page of docs/validation/
python -m docs.make.validation patches keratin    # in two dimensions; a minute
python -m docs.make.validation measured FILE      # cut the measured scale, see data/
python -m docs.make.validation coated             # under a coat; half an hour; extra `validation`
python -m docs.make.validation films              # under a film; seconds
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from mitsuba_diffraction.cli import Bar, check_outputs, say_error
from mitsuba_diffraction.errors import DiffractionError

from .cases import MATERIALS

# folder of the stored solutions
_DATA = Path(__file__).parent / "data"


def main(argv: Sequence[str] | None = None) -> int:
    """Run one of the commands, and return the exit code: 0, 1 (failed) or 2 (usage)."""
    parser = argparse.ArgumentParser(
        prog="python -m docs.make.validation", description=__doc__.split("\n")[0]
    )
    commands = parser.add_subparsers(metavar="COMMAND", required=True)
    report = commands.add_parser("report", help="write validation.md and docs/validation/")
    report.add_argument("pages", metavar="PAGE", nargs="*", help="all of them by default")
    report.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=Path("docs"))
    report.add_argument("--quick", action="store_true", help="a small version, for tests")
    report.set_defaults(run=_report)
    solve = commands.add_parser("solve", help="solve gratings")
    solve.add_argument("material", choices=MATERIALS)
    solve.add_argument("--solver", choices=("integral", "coupled_wave"), default="integral")
    solve.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=_DATA)
    solve.add_argument("-j", "--jobs", metavar="N", type=_jobs, help="processes; all processors")
    solve.set_defaults(run=_solve)
    patches = commands.add_parser("patches", help="solve cells in two dimensions")
    patches.add_argument("material", choices=("keratin", "aluminium"))
    patches.add_argument("--solver", choices=("coupled_wave", "rayleigh"), default="rayleigh")
    patches.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=_DATA)
    patches.set_defaults(run=_patches)
    measured = commands.add_parser("measured", help="cut the measured scale")
    measured.add_argument("patch", type=Path, help="the measured scale, in an image")
    measured.add_argument("--pixel-size", type=float, default=65 / 1332, metavar="MICROMETRES")
    measured.add_argument("--max-height", type=float, default=0.375, metavar="MICROMETRES")
    measured.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=_DATA)
    measured.set_defaults(run=_measured, progress=False)
    coated = commands.add_parser("coated", help="solve gratings under a coat")
    coated.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=_DATA)
    coated.set_defaults(run=_coated)
    films = commands.add_parser("films", help="solve gratings under a film")
    films.add_argument("-o", "--output", metavar="FOLDER", type=Path, default=_DATA)
    films.set_defaults(run=_films)
    for command in (report, solve, patches, coated, films):
        command.add_argument(
            "--progress", action=argparse.BooleanOptionalAction, default=None,
            help="show progress bars; by default on a terminal",
        )  # fmt: skip
    args = parser.parse_args(argv)
    try:
        return int(args.run(args))
    except DiffractionError as error:
        say_error(str(error))
        return 1
    except KeyboardInterrupt:
        say_error("interrupted; no half-written file was left behind")
        return 130


def _report(args: argparse.Namespace) -> int:
    from .pages.report import PAGES, page_path, write_report

    names = args.pages or list(PAGES)
    for name in names:
        if name not in PAGES:
            raise DiffractionError(f"page '{name}' is unknown; choose from {', '.join(PAGES)}")
        check_outputs([page_path(args.output, name)], make_folder=True)
    with Bar(args) as bar:
        paths = write_report(args.output, names, quick=args.quick, progress=bar)
    print("\n".join(f"wrote {path}" for path in paths))
    return 0


def _solve(args: argparse.Namespace) -> int:
    from .solutions import file_name, save
    from .solve import solve_material

    path = args.output / file_name(args.material, args.solver)
    check_outputs([path])
    with Bar(args, unit=" scans") as bar:
        solutions = solve_material(args.material, args.solver, processes=args.jobs, progress=bar)
    save(solutions, path)
    print(
        f"wrote {os.fspath(path)}: {len(solutions.rows)} orders; the last refinement changed "
        f"them by {solutions.change.max():.1g} at most"
    )
    return 0


def _patches(args: argparse.Namespace) -> int:
    from .patch_solutions import patch_file, solve_patches

    path = args.output / patch_file(args.material, args.solver)
    check_outputs([path])
    with Bar(args, unit=" cases") as bar:
        rows = solve_patches(args.material, args.solver, path, bar)
    print(f"wrote {os.fspath(path)}: {len(rows)} orders")
    return 0


def _measured(args: argparse.Namespace) -> int:
    from mitsuba_diffraction import HeightField

    from .patches import measured_cuts, save_measured

    patch = HeightField.load(args.patch, pixel_size=args.pixel_size, max_height=args.max_height)
    print(f"wrote {save_measured(measured_cuts(patch), args.output)}")
    return 0


def _coated(args: argparse.Namespace) -> int:
    from .coated import SERIES, coated_file, solve_coated

    for series in SERIES:
        check_outputs([args.output / coated_file(series)])
    with Bar(args, unit=" gratings") as bar:
        by_series = solve_coated(args.output, bar)
    for series, rows in by_series.items():
        print(f"wrote {os.fspath(args.output / coated_file(series))}: {len(rows)} orders")
    return 0


def _films(args: argparse.Namespace) -> int:
    from .filmed import STACKS, solve_films

    for stack in STACKS:
        check_outputs([args.output / stack.file])
    with Bar(args, unit=" films") as bar:
        for path in solve_films(args.output, bar):
            print(f"wrote {os.fspath(path)}")
    return 0


def _jobs(text: str) -> int:
    try:
        count = int(text)
    except ValueError:
        count = 0
    if count < 1:
        raise argparse.ArgumentTypeError(f"expected a whole number from 1, got '{text}'")
    return count


if __name__ == "__main__":
    sys.exit(main())
