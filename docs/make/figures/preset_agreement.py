"""Balls of all presets by Mitsuba, by the shaders of window and page, and by Cycles: ΔE2000.

python -m docs.make.figures.preset_agreement

Prints a table, and writes a sheet of the balls, a row for each renderer, into out/presets.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from PIL import Image

import mitsuba_diffraction as md
from docs.make.blender.compare import Comparison, compare
from docs.make.blender.views import Surface, View
from mitsuba_diffraction.cli import main as program
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.optics.colour import delta_e, encode_srgb
from mitsuba_diffraction.plugin.presets import presets

from . import pages

_FOLDER = Path("out/presets")
_SIZE, _BLOCK = (48, 32), 2


def exported(name: str) -> Path | None:
    """Return the folder of a look's material for Blender, or None if Cycles cannot show it."""
    folder = _FOLDER / name
    if list(folder.glob("*.osl")):
        return folder.resolve()
    return (
        None if program(["export-osl", "--preset", name, "-o", str(folder)]) else folder.resolve()
    )


def view_of(name: str, light: str, folder: Path | None) -> View:
    """Return the ball of a look for Mitsuba and Cycles."""
    cycles: dict[str, Any] = {"grey": 0.0}
    if folder:
        cycles = {"folder": str(folder), "tangent": "uv", "inputs": {}}
    return View("sphere", light, Surface(md.preset(name), cycles), *_SIZE)


def shaded(view: View, frames: int) -> tuple[Any, Any] | None:
    """Return two halves of the samples of the shader `fast`, or None if it cannot show a look."""
    try:
        renderer = md.glsl.Renderer(mi.load_dict(view.for_mitsuba()))
    except DiffractionError:
        return None
    size = (4 * _SIZE[0], 4 * _SIZE[1])
    light = renderer.progressive("fast", size=size)
    sums = []
    for _ in range(2):
        light.advance(frames // 2)
        rows = light.image[..., :3].reshape(_SIZE[1], 4, _SIZE[0], 4, 3)
        sums.append(rows.mean(axis=(1, 3), dtype=np.float64))
    light.release()
    renderer.release()
    return sums[0], 2.0 * sums[1] - sums[0]


def _blocks(picture: Any) -> Any:
    parts = np.asarray(picture).reshape(_SIZE[1] // _BLOCK, _BLOCK, _SIZE[0] // _BLOCK, _BLOCK, 3)
    return parts.mean(axis=(1, 3))


def of_shaders(found: Comparison, halves: tuple[Any, Any]) -> tuple[float, float]:
    """Return the mean ΔE2000 of the shaders' picture beyond noise, and the noise."""
    reference, first, second = map(_blocks, (found.mitsuba, *halves))
    covered = found.covered
    white = 1.0 / float(np.percentile(reference[covered].mean(axis=-1), 95.0))
    inside = np.nan_to_num(delta_e(reference, 0.5 * (first + second), exposure=white))[covered]
    own = 0.5 * np.nan_to_num(delta_e(first, second, exposure=white))[covered].mean()
    noise = math.hypot(own, math.sqrt(max(found.noise**2 - found.noise_of_cycles**2, 0.0)))
    return math.sqrt(max(inside.mean() ** 2 - noise**2, 0.0)), noise


def main(argv: Sequence[str] | None = None) -> int:
    """Render, print the table, write the sheet; return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.preset_agreement")
    parser.add_argument("--light", default="lamp", help="lamp or sky; default: lamp")
    parser.add_argument("--samples", type=int, default=1024, help="of Mitsuba; default: 1024")
    parser.add_argument("--cycles", type=int, default=256, help="samples of Cycles; default: 256")
    parser.add_argument("names", nargs="*", metavar="NAME", help="looks; default: all")
    args = parser.parse_args(argv)

    def work() -> None:
        mi.set_variant("llvm_ad_rgb")
        _FOLDER.mkdir(parents=True, exist_ok=True)
        names = args.names or list(presets())
        folders = {name: exported(name) for name in names}
        views = [view_of(name, args.light, folders[name]) for name in names]
        compared = compare(
            views, _FOLDER, mitsuba_samples=args.samples, cycles_samples=args.cycles,
            working_space="Linear Rec.709", block=_BLOCK,
        )  # fmt: skip
        rows, columns = [], []
        for name, view, found in zip(names, views, compared, strict=True):
            halves = shaded(view, 256)
            drawn = np.zeros_like(found.mitsuba) if halves is None else np.mean(halves, axis=0)
            page = (
                "" if halves is None else "{:.1f} (noise {:.1f})".format(*of_shaders(found, halves))
            )
            blender = f"{found.beyond_noise:.1f} (noise {found.noise:.1f})" if folders[name] else ""
            rows.append((name, page, blender))
            white = np.percentile(found.mitsuba.mean(axis=-1), 97.0)
            columns.append(np.concatenate([found.mitsuba, drawn, found.cycles]) / white)
        print(pages.table(("look", "page", "Blender"), rows))
        sheet = (255.0 * encode_srgb(np.concatenate(columns, axis=1)) + 0.5).astype(np.uint8)
        picture = Image.fromarray(sheet)
        larger = picture.resize((2 * picture.width, 2 * picture.height))
        larger.save(_FOLDER / f"agreement_{args.light}.png")

    return pages.exit_code("preset_agreement", work)


if __name__ == "__main__":
    sys.exit(main())
