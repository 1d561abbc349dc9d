"""Pictures of solved orders beside those of the model, and their difference: docs/orders.md.

python -m docs.make.figures.orders [--quick] [--only cd]
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from PIL import Image

from docs.make.blender.compare import blocks
from mitsuba_diffraction.arrays import Real, Single
from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.optics.display import natural
from mitsuba_diffraction.scene import load_scene, read_exr, set_variant

from . import pages
from .pages import option, program

#: Largest size of a picture, bytes.
_MOST = 150_000
#: Side of the blocks that are compared, pixels.
_BLOCK = 6
#: ΔE2000 at the end of the colour bar.
_END = 20.0


@dataclass(frozen=True)
class Scene:
    """A scene, rendered with its table of orders and with the model.

    Attributes
    ----------
    name : of the scene's file and of the picture.
    title : of the row.
    surface : id of the BSDF of the grating.
    shape : id of the shape on which colours are compared.
    recipe : of heights with the table's profile, for the model.
    parameters : of the BSDF with the model.
    flags : size and samples.
    """

    name: str
    title: str
    surface: str
    shape: str
    recipe: str
    parameters: str
    flags: tuple[str, ...]


_RECIPE = """generator = "{}"
tolerance = 1e-3
output = "model.exr"

[arguments]
"""
_BLAZED = _RECIPE.format("blazed") + "period = 1.6667\ndepth = 0.2939\npixels_per_period = 60\n"
SCENES = (
    Scene(
        "cd", "CD", "tracks", "data",
        _RECIPE.format("lamellar") + "period = 1.6\ndepth = 0.12\npixels_per_period = 64\n",
        "material=Al,coat_ior=1.58", ("resx=450", "resy=330", "spp=128"),
    ),
    Scene(
        "grating", "blazed grating, 600 lines/mm, Al", "rulings", "grating", _BLAZED,
        "material=Al,orientation=-90", ("resx=420", "resy=330", "spp=256"),
    ),
    Scene(
        "orders_on_wall", "the same grating before a wall", "rulings", "wall", _BLAZED,
        "material=Al", ("resx=450", "resy=210", "spp=512"),
    ),
    Scene(
        "spectrometer", "clear grating, 600 lines/mm", "rulings", "screen",
        _RECIPE.format("sinusoidal") + "period = 1.6667\ndepth = 0.09\npixels_per_period = 24\n",
        "thin=true,int_ior=1.58", ("resx=420", "resy=240", "spp=160"),
    ),
)  # fmt: skip
_HEADER = (
    "scene", "mean ΔE2000", "95th percentile", "processor time, solved / model",
)  # fmt: skip


@dataclass(frozen=True)
class Rendered:
    """Linear sRGB (ny, nx, 3) of blocks of pixels, file for a display, and processor time, s."""

    pixels: Single
    display: Path
    seconds: float


def row(scene: Scene, output: Path, folder: Path, flags: Sequence[str]) -> tuple[str, ...]:
    """Render both, write the picture, and return the row of the table."""
    recipe = folder / f"{scene.name}.toml"
    recipe.write_text(scene.recipe, encoding="utf-8")
    material = f"{scene.surface}={recipe},{scene.parameters}"
    options = [word for flag in flags for word in ("-D", flag)]
    model = _render(scene, folder / "model.exr", [*options, "--assign", material])
    solved = _render(scene, folder / "solved.exr", options)
    difference = delta_e(natural(solved.pixels), natural(model.pixels), exposure=1.0, least=0.0)
    _show(model, solved, difference, output / f"{scene.name}.jpg")
    changed = difference[_is_on(scene, flags)]
    return (
        scene.title,
        f"{changed.mean():.1f}",
        f"{np.percentile(changed, 95):.1f}",
        f"{solved.seconds / model.seconds:.2f}",
    )


def _is_on(scene: Scene, flags: Sequence[str]) -> NDArray[np.bool_]:
    """Mask of the blocks whose corners the camera sees on the shape."""
    set_variant(None)
    loaded = load_scene(_file(scene), dict(flag.split("=", 1) for flag in flags))
    sensor = loaded.sensors()[0]
    width, height = sensor.film().size()
    x, y = np.meshgrid(np.arange(0, width + 1, _BLOCK), np.arange(0, height + 1, _BLOCK))
    place = mi.Point2f(x.ravel() / width, y.ravel() / height)
    ray, _ = sensor.sample_ray(0.0, 0.5, place, mi.Point2f(0.5))
    (shape,) = (shape for shape in loaded.shapes() if shape.id() == scene.shape)
    on = np.array(loaded.ray_intersect(ray).shape == mi.ShapePtr(shape)).reshape(x.shape)
    return np.asarray(on[1:, 1:] & on[1:, :-1] & on[:-1, 1:] & on[:-1, :-1])


def _file(scene: Scene) -> Path:
    return Path("scenes") / f"{scene.name}.xml"


def _render(scene: Scene, output: Path, options: Sequence[str]) -> Rendered:
    seconds = 0.0
    for few in (["-s", "1"], []):  # the first compiles, and builds tables
        start = time.process_time()
        pages.run("render", _file(scene), "-o", output, *options, *few)
        seconds = time.process_time() - start
    pixels = blocks(np.array(read_exr(output))[..., :3], _BLOCK)
    return Rendered(pixels, output.with_suffix(".png"), seconds)


def _show(model: Rendered, solved: Rendered, difference: Real, target: Path) -> None:
    """Write both pictures and a map of their difference side by side."""
    target.parent.mkdir(parents=True, exist_ok=True)
    with Image.open(model.display) as picture:
        height = 4.6 * picture.height / picture.width + 0.35
    fig = Figure(figsize=(14.4, height), dpi=100, layout="constrained")
    axes = fig.subplots(1, 3)
    for ax, title, rendered in zip(axes, ("model", "solved"), (model, solved), strict=False):
        with Image.open(rendered.display) as picture:
            ax.imshow(np.asarray(picture.convert("RGB")))
        ax.set_title(title)
    drawn = axes[2].imshow(difference, cmap="magma", vmin=0.0, vmax=_END)
    axes[2].set_title("difference")
    fig.colorbar(drawn, ax=axes[2], label="ΔE2000", extend="max")
    for ax in axes:
        ax.axis("off")
    pages.write_figure(target, fig, most=_MOST)


@program(
    option("-o", "--output", type=Path, default=Path("docs"), help="of the page"),
    option("--quick", action="store_true", help="small and noisy"),
    option(
        "--only", choices=[scene.name for scene in SCENES], help="one picture, and not the page",
    ),
)  # fmt: skip
def main(args: argparse.Namespace) -> None:
    """Render, write the pictures and the page."""
    images = args.output / "images/orders"
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for scene in SCENES:
            if args.only in (None, scene.name):
                flags = ("resx=90", "resy=70", "spp=8") if args.quick else scene.flags
                rows.append(row(scene, images, Path(folder), flags))
                print("  ".join(rows[-1]), flush=True)
    if args.only is None:
        parts = {"orders": pages.table(_HEADER, rows), "block": f"{_BLOCK}"}
        pages.update(args.output / "orders.md", parts)
