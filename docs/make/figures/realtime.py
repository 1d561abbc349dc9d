"""Picture and tables of docs/realtime.md, from measurements by `compare`.

mitsuba-diffraction compare scenes/snake.xml --method all -o out/compare/snake
mitsuba-diffraction compare scenes/cd.xml --method fast exact -o out/compare/cd
python -m docs.make.figures.realtime out/compare/snake out/compare/cd
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from mitsuba_diffraction.realtime.shader_comparison.report import markdown, plain_number

from . import pages
from .pages import exit_code, from_json, write_jpeg

PAGE = Path("docs", "realtime.md")
#: Beside the page; the picture that it shows is that of the default method.
SHEET = Path("images", "realtime.jpg")

_OURS = ("fast", "exact")
_METHOD, _WIDTH = "fast", 1600


def main(argv: Sequence[str] | None = None) -> int:
    """Replace picture and tables, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.realtime")
    parser.add_argument(
        "compared", metavar="FOLDER", type=Path, nargs="+",
        help="written by compare; of the first the sheet and all methods are shown",
    )  # fmt: skip
    parser.add_argument(
        "--sheet", metavar="FOLDER", type=Path,
        help="a larger picture, of which the sheet is shown; default: the first's",
    )  # fmt: skip
    parser.add_argument(
        "-o", "--output", metavar="FILE", type=Path, default=Path("docs/realtime.md")
    )
    args = parser.parse_args(argv)

    def work() -> None:
        text = _tables([folder / "compare.json" for folder in args.compared])
        sheet = args.output.parent / SHEET
        folder = args.sheet or args.compared[0]
        text += _of_sheet(folder) if args.sheet else ""
        write_jpeg(folder / f"{_METHOD}.png", sheet, width=_WIDTH)
        pages.update(args.output, {"realtime": text})

    return exit_code("realtime", work)


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
    return f"{scenes}\n\n{markdown(documents[0])}"


def _of_sheet(folder: Path) -> str:
    """Sentence with the measurements of the larger picture."""
    document = from_json(
        folder / "compare.json", lambda d: (d["methods"][_METHOD]["whole"], d)[1],
        writer="compare", remedy=f"run compare with the method {_METHOD}",
    )  # fmt: skip
    whole = document["methods"][_METHOD]["whole"]
    width, height = document["size"]
    return (
        f"\n\nThe picture above: `{_METHOD}`, {width} × {height} pixels, ΔE2000 "
        f"{plain_number(whole['direct']['delta_e_mean'])}, of which noise: "
        f"{plain_number(whole['noise']['delta_e_mean'])} of the shaders, "
        f"{plain_number(document['whole_noise']['delta_e_mean'])} of the path tracer."
    )


def scenes_table(documents: Sequence[dict[str, Any]]) -> str:
    """Deviations of `fast` and `exact` in some scenes, over all pixels."""
    head = "| scene |" + "".join(
        f" `{m}`, ΔE2000 mean | 99 % | noise, mean | 99 % |" for m in _OURS
    )
    rows = [head + " noise of the path tracer, mean | 99 % |", "|---|" + 10 * "---|"]
    for document in documents:
        cells = [f"[{Path(document['scene']).stem}]({document['scene']})"]
        for method in _OURS:
            whole = document["methods"][method]["whole"]
            cells += [
                plain_number(whole["direct"]["delta_e_mean"]),
                plain_number(whole["direct"]["delta_e_percentiles"]["99"]),
                plain_number(whole["noise"]["delta_e_mean"]),
                plain_number(whole["noise"]["delta_e_99"]),
            ]
        noise = document["whole_noise"]
        cells += [plain_number(noise["delta_e_mean"]), plain_number(noise["delta_e_99"])]
        rows.append(f"| {' | '.join(cells)} |")
    return "\n".join(rows)


def _complete(document: dict[str, Any]) -> dict[str, Any]:
    markdown(document), scenes_table([document])  # what is missing is missed here
    return document


if __name__ == "__main__":
    sys.exit(main())
