"""The tables of docs/accuracy.md, from what `tradeoff` measured.

mitsuba-diffraction tradeoff -o out/tradeoff
python -m docs.make.figures.tradeoff out/tradeoff
"""

from __future__ import annotations

import argparse
import shutil
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from mitsuba_diffraction.atomic import atomic_path

from . import markers
from .program import add_pages, exit_code, from_json

_HEAD = (
    "setting", "error", "ΔE2000, mean (99 %)", "`eval` / `roughconductor`", "taps × numbers", "MB",
    "built in, s",
)  # fmt: skip


def tables(measured: dict[str, Any]) -> dict[str, str]:
    """Markdown by the name of its markers: `settings` and `spectral`.

    Parameters
    ----------
    measured : the content of `tradeoff.json`.
    """
    settings = measured["settings"]
    machine = measured["machine"]
    where = f"{measured['patch']}; {machine['cores']} cores ({machine['processor']})"
    return {
        "settings": f"{markers.table(_HEAD, tuple(_rows(settings)))}\n\n{where}.",
        "spectral": _spectral(measured["spectral"]),
    }


def _rows(records: Sequence[dict[str, Any]]) -> Iterator[tuple[str, ...]]:
    for record in records:
        if record["refused"]:
            yield record["setting"], f"refused: {record['refused']}", "", "", "", "", ""
            continue
        yield (
            record["setting"],
            f"{record['error']:.1e}",
            f"{record['delta_e']:.3f} ({record['delta_e_99']:.2f})",
            f"{record['relative']:.2f}",
            f"{record['taps']} × {record['terms']} ({record['precision']})",
            f"{record['megabytes']:.1f}",
            f"{record['seconds']:.1f}",
        )


def _spectral(spectral: dict[str, Any]) -> str:
    steps, counts = spectral["steps"], spectral["counts"]
    by_step = markers.table(
        ("step of a sum", *(f"{float(step):g} nm" for step in steps)),
        [("ΔE2000, mean", *(f"{error:.2f}" for error in steps.values()))],
    )
    by_count = markers.table(
        ("wavelengths of a ray", *counts),
        [("noise of its luminance", *(f"{noise:.2f}" for noise in counts.values()))],
    )
    return f"{by_step}\n\n{by_count}"


def main(argv: Sequence[str] | None = None) -> int:
    """Replace the tables and copy the plots, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.tradeoff")
    parser.add_argument("measured", metavar="FOLDER", type=Path, help="from tradeoff -o")
    add_pages(parser, "docs/accuracy.md")
    parser.add_argument("--images", metavar="FOLDER", type=Path, default=Path("docs/images"))
    args = parser.parse_args(argv)

    def work() -> None:
        file = args.measured / "tradeoff.json"
        found = from_json(file, tables, writer="tradeoff", remedy="run make tradeoff")
        for page in args.output:
            markers.update_present(page, found)
        for name in ("tradeoff.png", "depth.png"):
            with atomic_path(args.images / name) as temporary:
                shutil.copyfile(args.measured / name, temporary)

    return exit_code("tradeoff", work)


if __name__ == "__main__":
    sys.exit(main())
