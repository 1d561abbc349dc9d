"""Picture of all presets for docs/gallery.md.

python -m docs.make.figures.presets -o docs
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path

from PIL import Image, ImageDraw

from .pages import from_json, option, program, run, write_jpeg

PICTURE = Path("images", "presets.jpg")
_MESH = Path("scenes", "meshes", "knot.ply")
_COLUMNS, _SIZE, _LABEL = 5, (160, 147), 16
_MOST = 160_000  # bytes of the picture


def draw(folder: Path, samples: int) -> Path:
    """Render a mesh of each preset in the studio of meshes; return the picture of all."""
    width, height = _SIZE
    run("presets", "--json", folder / "presets.json")
    names = from_json(
        folder / "presets.json", lambda listed: [each["name"] for each in listed["presets"]],
        writer="presets", remedy="update the package",
    )  # fmt: skip
    rows = -(-len(names) // _COLUMNS)
    sheet = Image.new("RGB", (_COLUMNS * width, rows * (height + _LABEL)), "white")
    pen = ImageDraw.Draw(sheet)
    for number, name in enumerate(names):
        one = folder / f"{name}.png"
        run(
            "render", _MESH, "--preset", name, "-s", samples, "-D", f"resx={width}",
            "-D", f"resy={height}", "--clamp", 20, "--denoise", "-o", one,
        )  # fmt: skip
        x, y = number % _COLUMNS * width, number // _COLUMNS * (height + _LABEL)
        with Image.open(one.with_stem(f"{name}_denoised")) as picture:
            sheet.paste(picture.convert("RGB"), (x, y))
        pen.text((x + width / 2, y + height + 2), name, fill="black", anchor="ma")
    written = folder / "presets.png"
    sheet.save(written)
    return written


@program(
    option("-o", "--output", type=Path, default=Path("docs"), help="of the pages"),
    option("-s", "--samples", type=int, default=32, help="per pixel; default: 32"),
)
def main(args: argparse.Namespace) -> None:
    """Render the pictures and write them as one."""
    with tempfile.TemporaryDirectory() as folder:
        picture = draw(Path(folder), args.samples)
        write_jpeg(picture, args.output / PICTURE, most=_MOST)
