"""Pictures of solved orders beside those of the model, and their difference: docs/orders.md.

python -m docs.make.figures.orders [--quick]
"""

from __future__ import annotations

import argparse
import contextlib
import io
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from mitsuba_diffraction.cli import main as program
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.scene.pictures import read_exr

from . import pages
from .pages import exit_code, write_jpeg

#: Largest size of a picture, bytes.
_MOST = 150_000
#: Side of the blocks that are compared, pixels.
_BLOCK = 5


@dataclass(frozen=True)
class Scene:
    """A scene, rendered with the model and with a table.

    Attributes
    ----------
    title : heading of the row.
    file, surface, table : scene, id of its BSDF, and the table of orders, under the project.
    recipe : of heights with the table's profile, for the model.
    """

    title: str
    file: str
    surface: str
    table: str
    recipe: str


_RECIPE = """generator = "{}"
tolerance = 1e-3
output = "model.exr"

[arguments]
"""
SCENES = (
    Scene(
        "CD", "scenes/cd.xml", "tracks", "precompute/orders/cd.nc",
        _RECIPE.format("lamellar") + "period = 1.6\ndepth = 0.12\npixels_per_period = 64\n",
    ),
    Scene(
        "blazed grating, 600 lines/mm, Al", "scenes/grating.xml", "rulings",
        "precompute/orders/blazed.nc",
        _RECIPE.format("blazed") + "period = 1.6667\ndepth = 0.2939\npixels_per_period = 60\n",
    ),
)  # fmt: skip
_INTRODUCTION = (
    "Left: the model of `diffraction`. Right: solved orders of the same profile, in the same "
    "light. Ridges half as wide as the period have no second order in the model."
)
_HOW = (
    "`python -m docs.make.figures.orders` makes the pictures and the table, of blocks of 5 pixels "
    "whose light differs by more than 2 %."
)
_HEADER = ("scene", "mean ΔE2000", "95th percentile", "seconds, model", "seconds, solved")


@dataclass(frozen=True)
class Rendered:
    """Linear sRGB (ny, nx, 3) of blocks of pixels, the file for a display, and the time, s."""

    pixels: NDArray[np.float32]
    display: Path
    seconds: float


def row(scene: Scene, output: Path, folder: Path, flags: Sequence[str]) -> tuple[str, ...]:
    """Render both, write the picture, and return the row of the table."""
    recipe = folder / "recipe.toml"
    recipe.write_text(scene.recipe, encoding="utf-8")
    material = ["--material", f"{scene.surface}={scene.table}"]
    name = Path(scene.file).stem
    model = _render(scene, folder / f"{name}_model.exr", ["-D", f"patch={recipe}", *flags])
    solved = _render(scene, folder / f"{name}_solved.exr", [*material, *flags])
    _side_by_side(model, solved, output / f"{name}.jpg")
    difference = delta_e(solved.pixels, model.pixels)
    changed = difference[np.isfinite(difference) & _diffracts(model, solved)]
    return (
        scene.title,
        f"{changed.mean():.1f}",
        f"{np.percentile(changed, 95):.1f}",
        f"{model.seconds:.0f}",
        f"{solved.seconds:.0f}",
    )


def _blocks(pixels: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return means over blocks of pixels, in which noise is below the differences."""
    rows, columns = (size // _BLOCK for size in pixels.shape[:2])
    cut = pixels[: rows * _BLOCK, : columns * _BLOCK, :3]
    return cut.reshape(rows, _BLOCK, columns, _BLOCK, 3).mean(axis=(1, 3))


def _diffracts(model: Rendered, solved: Rendered) -> NDArray[np.bool_]:
    """Mask of the blocks whose light differs by more than their noise: those of the grating."""
    both = 0.5 * (model.pixels + solved.pixels).sum(axis=-1)
    apart = np.abs(model.pixels - solved.pixels).sum(axis=-1)
    return np.asarray(apart > 0.02 * both)


def _render(scene: Scene, output: Path, flags: Sequence[str]) -> Rendered:
    words = ["render", scene.file, "-o", str(output), *flags]
    for _ in range(2):  # the second is without the time to compile
        start = time.perf_counter()
        with contextlib.redirect_stdout(io.StringIO()):
            if program(words) != 0:
                raise DiffractionError(f"'{' '.join(words)}' failed; see above")
        seconds = time.perf_counter() - start
    return Rendered(_blocks(np.array(read_exr(output))), output.with_suffix(".png"), seconds)


def _side_by_side(model: Rendered, solved: Rendered, target: Path) -> None:
    with Image.open(model.display) as left, Image.open(solved.display) as right:
        joined = Image.new("RGB", (left.width + right.width + 8, left.height), "white")
        joined.paste(left.convert("RGB"), (0, 0))
        joined.paste(right.convert("RGB"), (left.width + 8, 0))
    target.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "joined.png"
        joined.save(file)
        write_jpeg(file, target, most=_MOST)


def main(argv: Sequence[str] | None = None) -> int:
    """Render, write the pictures and the page, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.orders")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs"), help="of the page")
    parser.add_argument("--quick", action="store_true", help="small and noisy")
    args = parser.parse_args(argv)
    small = ["-D", "resx=300", "-D", "resy=220"]
    flags = [*small, "-D", "spp=64"] if args.quick else ["-D", "spp=96"]

    def work() -> None:
        with tempfile.TemporaryDirectory() as folder:
            images_folder = args.output / "images/orders"
            rows = [row(scene, images_folder, Path(folder), flags) for scene in SCENES]
        shown = [
            f"![{scene.title}: the model, and solved orders](images/orders/{name}.jpg)"
            for scene in SCENES
            for name in [Path(scene.file).stem]
        ]
        page = "\n\n".join([_INTRODUCTION, *shown, pages.table(_HEADER, rows), _HOW])
        pages.update(args.output / "orders.md", {"orders": page})

    return exit_code("orders", work)


if __name__ == "__main__":
    sys.exit(main())
