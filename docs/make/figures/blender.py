"""Tables and pictures of docs/blender.md: Cycles beside Mitsuba, noise, and the example .blend.

python -m docs.make.figures.blender [-o docs] [--quick] [--samples N] [PART ...]
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np
from PIL import Image

import mitsuba_diffraction as md
from docs.make.blender.compare import Comparison, compare
from docs.make.blender.program import run_in_blender, seconds
from docs.make.blender.views import LIGHTS, Surface, View
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.optics.colour import encode_srgb

from . import pages
from .pages import option, program

#: Folder of exported surfaces, kept for the next run.
_FOLDER = Path("out/blender")
_SHOWCASE = Path(__file__).parents[1] / "blender/showcase.py"
_PARTS = ("differences", "noise", "showcase")
_MOST = 100_000  # bytes of a picture
_PIGMENT = [0.1, 0.05, 0.02]


@dataclass(frozen=True)
class Example:
    """A surface that is compared.

    Attributes
    ----------
    source : of the export, under the project.
    shape : that shows it.
    turn, tangent : of the material in Blender, for the same direction as in Mitsuba.
    """

    source: str
    shape: str
    turn: float = 0.0
    tangent: str = "uv"

    @property
    def folder(self) -> Path:
        """Folder of the export."""
        return _FOLDER / Path(self.source).stem

    def export(self) -> None:
        """Export the surface unless it is there."""
        if not list(self.folder.glob("*.osl")):
            pages.run("export-osl", self.source, "-o", self.folder)

    def surface(self) -> Surface:
        """Return the material of both renderers."""
        inputs: dict[str, object] = {"Rotation (°)": self.turn}
        cycles = {"folder": str(self.folder.resolve()), "tangent": self.tangent, "inputs": inputs}
        if self.source.endswith(".nc"):
            table = md.OrderTable.load(self.source)
            return Surface(md.bsdf_dict(table, orientation=self.angle), cycles)
        inputs["Pigment"] = _PIGMENT
        pigment = {"type": "diffuse", "reflectance": {"type": "rgb", "value": _PIGMENT}}
        patch = str(Path(self.source).resolve())
        return Surface({"type": "diffraction", "filename": patch, "nested": pigment}, cycles)

    @property
    def angle(self) -> float:
        """Orientation in Mitsuba, whose disk has its tangent along the radius."""
        return 0.0 if self.tangent != "uv" else self.turn


EXAMPLES = {
    "disc": Example("precompute/orders/cd.nc", "disk", -90.0, "radial-z"),
    "grating": Example("precompute/orders/blazed.nc", "rectangle", 90.0),
    "scale": Example("precompute/elaphe_like.toml", "sphere"),
}
#: Surface of the ball in the middle of the example .blend.
FOIL = Example("precompute/orders/sinusoidal.nc", "sphere")
_HEADER = ("surface", "light", "ΔE2000 beyond noise", "noise")
_COUNTS = (16, 64, 256)
_NOISE = ("surface", "light", "16 samples", "64", "256", "seconds, 480 × 320 at 256")


def differences(samples: tuple[int, int], folder: Path) -> tuple[str, list[Comparison]]:
    """Return the table of differences, and the comparisons.

    samples : of Mitsuba and of Cycles.
    """
    keys, views = _views()
    compared = compare(
        views, folder, mitsuba_samples=samples[0], cycles_samples=samples[1],
        working_space="Linear Rec.709", block=2,
    )  # fmt: skip
    rows = [
        (name, light, f"{found.beyond_noise:.1f}", f"{found.noise:.1f}")
        for (name, light), found in zip(keys, compared, strict=True)
    ]
    return pages.table(_HEADER, rows), compared


def noise(folder: Path) -> str:
    """Return the table of Cycles' noise over samples, and of the time of a larger picture."""
    keys, views = _views()
    by_count = [
        compare(views, folder, mitsuba_samples=64, cycles_samples=count) for count in _COUNTS
    ]
    rows = []
    for (name, light), *found in zip(keys, *by_count, strict=True):
        # the difference of two pictures, without the time to build the scene
        first, last = (comparison.seconds.processor for comparison in (found[0], found[-1]))
        sample = (last - first) / (views[0].width * views[0].height * (_COUNTS[-1] - _COUNTS[0]))
        noises = [f"{comparison.noise_of_cycles:.1f}" for comparison in found]
        rows.append((name, light, *noises, f"{sample * 480 * 320 * 256:.0f}"))
    return pages.table(_NOISE, rows)


def _views() -> tuple[list[tuple[str, str]], list[View]]:
    """Return all surfaces in all lights: their names, and the views."""
    keys = [(name, light) for name in EXAMPLES for light in LIGHTS]
    surfaces = {name: example.surface() for name, example in EXAMPLES.items()}
    return keys, [View(EXAMPLES[name].shape, light, surfaces[name], 48, 32) for name, light in keys]


def side_by_side(compared: Sequence[Comparison], target: Path) -> None:
    """Write pictures of Mitsuba (above) and of Cycles (below), each pair at its own exposure."""
    columns = []
    for comparison in compared:
        both = np.concatenate([comparison.mitsuba, comparison.cycles])
        shown = np.clip(both / np.percentile(both.mean(axis=-1), 97.0), 0.0, 1.0)
        columns.append(encode_srgb(shown))
    image = Image.fromarray((255.0 * np.concatenate(columns, axis=1) + 0.5).astype(np.uint8))
    file = _FOLDER / "side_by_side.png"
    image.resize((4 * image.width, 4 * image.height), Image.Resampling.NEAREST).save(file)
    pages.write_jpeg(file, target, width=1152, most=_MOST)


def showcase(target: Path, samples: int) -> None:
    """Build the example .blend, render it, and print the seconds of the render."""
    folders = [str(example.folder) for example in (EXAMPLES["disc"], FOIL, EXAMPLES["scale"])]
    picture, file = _FOLDER / "showcase.png", _FOLDER / "showcase.blend"
    words = ["--output", str(file), "--picture", str(picture), "--samples", str(samples)]
    time = seconds(run_in_blender(_SHOWCASE, [*folders, *words]))[0]
    print(f"{picture}: {time.clock:.0f} s, {time.processor:.0f} s of processor")
    pages.write_jpeg(picture, target, most=_MOST)


@program(
    option("-o", "--output", type=Path, default=Path("docs"), help="of the page"),
    option("--quick", action="store_true", help="small and noisy"),
    option("--samples", type=int, default=256, help="of the example's picture; 256"),
    option("parts", nargs="*", metavar="PART", help=f"{', '.join(_PARTS)}; all"),
)
def main(args: argparse.Namespace) -> None:
    """Compare, render, write the pictures and the page."""
    if unknown := set(args.parts) - set(_PARTS):
        raise DiffractionError(
            f"unknown part {', '.join(unknown)}; choose from {', '.join(_PARTS)}"
        )
    mi.set_variant("llvm_ad_rgb")
    images = args.output / "images/blender"
    work_folders = [_FOLDER / part for part in _PARTS]
    for folder in (*work_folders, images):
        folder.mkdir(parents=True, exist_ok=True)
    for example in (*EXAMPLES.values(), FOIL):
        example.export()
    parts, page = args.parts or _PARTS, args.output / "blender.md"
    if "differences" in parts:
        samples = (512, 64) if args.quick else (8192, 768)
        table, compared = differences(samples, work_folders[0])
        pages.update(page, {"differences": table})
        side_by_side(compared, images / "comparison.jpg")
    if "noise" in parts:
        pages.update(page, {"noise": noise(work_folders[1])})
    if "showcase" in parts:
        showcase(images / "showcase.jpg", 16 if args.quick else args.samples)
