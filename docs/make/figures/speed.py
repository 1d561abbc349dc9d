"""The table of speed and quality in docs/benchmarks.md, from what `bench` measured.

mitsuba-diffraction bench --json out/bench.json
python -m docs.make.figures.speed out/bench.json
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from mitsuba_diffraction.errors import DiffractionError

from . import markers
from .program import exit_code, from_json

PAGE = Path("docs", "benchmarks.md")


@dataclass(frozen=True)
class Figure:
    """One line of the table.

    Attributes
    ----------
    section, row : how the section's title and the row's name begin.
    words : what is said of it.
    column : of the row.
    pattern : how the number is written.
    goal : which of the row's goals is for this number.
    """

    section: str
    row: str
    words: str
    column: str
    pattern: str
    goal: int | None = None


_ROUGH, _DEFAULT = "× roughconductor", "diffraction, the defaults"
_EFFICIENCY, _DELTA = "variance × time, ratio", "mean ΔE2000"
FIGURES = (
    Figure("build", "1332²", "table of 1332² pixels", "s", "{:.1f} s", 0),
    Figure("build", "1332²", "its memory, Python's included", "GB at most", "{:.2f} GB", 1),
    Figure("build", "4096²", "table of 4096² pixels", "s", "{:.0f} s", 0),
    Figure("build", "4096²", "its memory", "GB at most", "{:.2f} GB", 1),
    Figure("build", "8192²", "table of 8192² pixels", "s", "{:.0f} s", 0),
    Figure("build", "8192²", "its memory", "GB at most", "{:.2f} GB", 1),
    Figure("eval", _DEFAULT, "`eval` / `roughconductor` (Al)", _ROUGH, "{:.1f}", 0),
    Figure("eval", "diffraction, tolerance 1e-2", "the same, tolerance 1e-2", _ROUGH, "{:.1f}", 0),
    Figure("eval", "principled, metal", "`principled` / `roughconductor`", _ROUGH, "{:.1f}"),
    Figure("eval", "measured", "`measured` / `roughconductor`", _ROUGH, "{:.0f}"),
    Figure("eval", _DEFAULT, "`eval` / bare gathers of its memory", "× gathers", "{:.2f}", 1),
    Figure("eval", "thesis", "the thesis' look-up / `eval`", "× defaults", "{:.0f}", 0),
    Figure("sample", _DEFAULT, "`sample` / `roughconductor` (Al)", _ROUGH, "{:.1f}"),
    Figure("snake", "the skin", "the snake's scene / with `roughconductor`", _ROUGH, "{:.1f}", 0),
    Figure("noise", "0°", "noise of one sample, light from 0°", "most", "{:.2f}", 0),
    Figure("noise", "45°", "from 45°", "most", "{:.2f}", 0),
    Figure("noise", "75°", "from 75°", "most", "{:.2f}", 0),
    Figure("efficiency", "white", "variance × time in a white furnace, cosine sampling's / ours",
           _EFFICIENCY, "{:.0f}", 0),
    Figure("efficiency", "snake", "the same, snake under a window", _EFFICIENCY, "{:.0f}", 0),
    Figure("efficiency", "snake", "its brightest pixel, 64 samples / converged",
           "brightest pixel, ratio", "{:.1f}", 1),
    Figure("colours", "map, diel", "RGB variants, ΔE2000 of a dielectric", _DELTA, "{:.2f}", 0),
    Figure("colours", "map, alu", "of aluminium's", _DELTA, "{:.2f}"),
    Figure("colours", "map, gold", "of gold's", _DELTA, "{:.1f}"),
    Figure("colours", "snake in the sun, pig", "of the snake in the sun", _DELTA, "{:.2f}", 0),
    Figure("colour table", "", "`eval`, RGB / spectral", "× spectral", "{:.2f}", 2),
)  # fmt: skip


def table(measured: dict[str, Any]) -> str:
    """Markdown: what was measured on which machine, and the goals.

    Parameters
    ----------
    measured : what `bench --json` wrote.

    Raises
    ------
    DiffractionError
        If a part was not measured.
    """
    machine = measured["machine"]
    head = f"Measured by `make bench` on {machine['cores']} cores ({machine['processor']})"
    versions = f"Mitsuba {machine['mitsuba']}, version {machine['mitsuba_diffraction']}"
    return f"{head}, {versions}.\n\n" + markers.table(
        ("", "figure", "goal"), tuple(_rows(measured["sections"]))
    )


def _rows(sections: list[dict[str, Any]]) -> Iterator[tuple[str, str, str]]:
    for figure in FIGURES:
        row = _row(sections, figure.section, figure.row)
        goal = ""
        if figure.goal is not None:
            said = row["goals"][figure.goal]
            goal = said["goal"] if said["met"] else f"**missed:** {said['goal']}"
        yield figure.words, figure.pattern.format(row["values"][figure.column]), goal


def _row(sections: list[dict[str, Any]], title: str, name: str) -> dict[str, Any]:
    for section in sections:
        if section["title"].startswith(f"{title}:"):
            for row in section["rows"]:
                if row["name"].startswith(name):
                    return dict(row)
    raise DiffractionError(
        f"nothing was measured of '{title}: {name}'; run bench in full: without --only or --quick"
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Replace the table, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.speed")
    parser.add_argument("measured", metavar="BENCH.json", type=Path, help="from bench --json")
    parser.add_argument("-o", "--output", metavar="FILE", type=Path, default=PAGE)
    args = parser.parse_args(argv)

    def work() -> None:
        text = from_json(args.measured, table, writer="bench --json", remedy="run make bench")
        markers.update(args.output, {"speed": text})

    return exit_code("speed", work)


if __name__ == "__main__":
    sys.exit(main())
