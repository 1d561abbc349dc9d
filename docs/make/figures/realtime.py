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

from mitsuba_diffraction.realtime.shader_comparison.report import plain_number

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
        help="written by compare; the page shows the first one's sheet, times and textures",
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
    return f"{scenes}\n\n{summary(documents[0])}"


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
    """Deviations of `fast` and `exact` in some scenes, over all pixels, and the noise in them."""
    header = ("scene", *(f"`{m}`" for m in _OURS), "noise of `exact`", "of the path tracer")
    rows = []
    high = 0.0
    for document in documents:
        wholes = [document["methods"][method]["whole"] for method in _OURS]
        values = [
            *(whole["direct"]["delta_e_mean"] for whole in wholes),
            wholes[-1]["noise"]["delta_e_mean"],
            document["whole_noise"]["delta_e_mean"],
        ]
        high = max(high, *(w["direct"]["delta_e_percentiles"]["99"] for w in wholes))
        link = f"[{Path(document['scene']).stem}]({document['scene']})"
        rows.append((link, *map(plain_number, values)))
    text = f"In each scene 99 % of the pixels have at most {plain_number(high)}."
    return f"{pages.table(header, rows)}\n\n{text}"


def summary(document: dict[str, Any]) -> str:
    """Sentences with the frame times, texture sizes and look-up errors in one scene."""
    fast, exact = (document["methods"][method] for method in _OURS)
    time = exact["whole"]["frame_ms"] / fast["whole"]["frame_ms"]
    share = 100 * fast["diffracting"]["share"]
    sizes = [plain_number(entry["texture_bytes"] / 1e6) for entry in (fast, exact)]
    errors = [
        f"{plain_number(entry['diffracting']['delta_e_mean'])} (99 %: "
        f"{plain_number(entry['diffracting']['delta_e_percentiles']['99'])}) by `{method}`"
        for method, entry in zip(_OURS, (fast, exact), strict=True)
    ]
    return (
        f"First scene: a frame by `exact` takes {plain_number(time)} times as long as by `fast`; "
        f"textures have {sizes[0]} MB (`fast`) and {sizes[1]} MB (`exact`). With point lights and "
        f"without shadows, over the {share:.0f} % of the pixels that diffract and are lit in both, "
        f"the mean is {' and '.join(errors)}: the error of tables and look-ups, with "
        f"{plain_number(document['noise_delta_e_mean'])} of noise."
    )


def _complete(document: dict[str, Any]) -> dict[str, Any]:
    summary(document), scenes_table([document])  # what is missing is missed here
    return document


if __name__ == "__main__":
    sys.exit(main())
