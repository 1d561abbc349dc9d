"""Picture and tables of docs/realtime.md, from measurements by `compare`.

mitsuba-diffraction compare scenes/snake.xml --method all -o out/compare/snake
mitsuba-diffraction compare scenes/cd.xml --method fast exact -o out/compare/cd
python -m docs.make.figures.realtime out/compare/snake out/compare/cd
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mitsuba_diffraction.realtime.shader_comparison import plain_number

from . import pages
from .pages import from_json, option, program, write_jpeg

PAGE = Path("docs", "realtime.md")
#: Beside the page; the picture that it shows is that of the default method.
SHEET = Path("images", "realtime.jpg")

_OURS = ("fast", "exact")
_METHOD, _WIDTH = "fast", 1600


def _tables(files: Sequence[Path]) -> str:
    documents = [
        from_json(
            file, _complete, writer="compare",
            remedy="run compare with the methods fast and exact, or all",
        )
        for file in files
    ]  # fmt: skip
    # links of `compare` start at the repository's root, those of the page in docs
    scenes = scenes_table(documents).replace("](scenes/", "](../scenes/")
    return f"{scenes}\n\n{summary(documents[0])}"


def scenes_table(documents: Sequence[dict[str, Any]]) -> str:
    """Deviations of `fast` and `exact` in some scenes, over all pixels, and the noise in them."""
    header = ("scene", *(f"`{m}`" for m in _OURS), "noise of `exact`", "of the path tracer")
    rows = []
    high = 0.0
    for document in documents:
        entries = [document["methods"][method] for method in _OURS]
        values = [
            *(entry["direct"]["delta_e_mean"] for entry in entries),
            entries[-1]["noise"]["delta_e_mean"],
            document["noise"]["delta_e_mean"],
        ]
        high = max(high, *(e["direct"]["delta_e_percentiles"]["99"] for e in entries))
        link = f"[{Path(document['scene']).stem}]({document['scene']})"
        rows.append((link, *map(plain_number, values)))
    text = f"In each scene 99 % of the pixels have at most {plain_number(high)}."
    return f"{pages.table(header, rows)}\n\n{text}"


def summary(document: dict[str, Any]) -> str:
    """Return a sentence with the frame times and texture sizes in one scene."""
    fast, exact = (document["methods"][method] for method in _OURS)
    sizes = [plain_number(entry["texture_bytes"] / 1e6) for entry in (fast, exact)]
    time = plain_number(exact["frame_ms"] / fast["frame_ms"])
    return (
        f"First scene: a frame by `exact` takes {time} times as long as by `fast`; textures have "
        f"{sizes[0]} MB (`fast`) and {sizes[1]} MB (`exact`)."
    )


def _complete(document: dict[str, Any]) -> dict[str, Any]:
    summary(document), scenes_table([document])  # what is missing is missed here
    return document


@program(
    option(
        "compared", metavar="FOLDER", type=Path, nargs="+",
        help="written by compare; the page shows the first one's sheet, times and textures",
    ),
    option(
        "--sheet", metavar="FOLDER", type=Path,
        help="a larger picture, of which the sheet is shown; default: the first's",
    ),
    option("-o", "--output", metavar="FILE", type=Path, default=Path("docs/realtime.md")),
)  # fmt: skip
def main(args: argparse.Namespace) -> None:
    """Replace picture and tables."""
    text = _tables([folder / "compare.json" for folder in args.compared])
    sheet = args.output.parent / SHEET
    folder = args.sheet or args.compared[0]
    write_jpeg(folder / f"{_METHOD}.png", sheet, width=_WIDTH)
    pages.update(args.output, {"realtime": text})
