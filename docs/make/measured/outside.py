"""Height maps and pictures of another wave-optics renderer, beside this package's reference.

KAIST-VCLAB/color-brdfs-with-wave-optics (Zeng et al., SIGGRAPH Asia 2025) has maps of 256² heights
beside pictures of their BRDF for light along the normal. It has no licence, so they are read from a
clone and not stored here. Its scripts say how they were made: 32² pixels of a size that the folder
names, eight wavelengths from 420 to 680 nm, a window of σ = factor · λ/0.5, and a range of sines.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

import mitsuba_diffraction  # noqa: F401  (sets Dr.Jit up before Mitsuba)
from mitsuba_diffraction import HeightField, reference
from mitsuba_diffraction.arrays import Real
from mitsuba_diffraction.optics import colour
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA

#: Repository of the maps.
REPOSITORY = "https://github.com/KAIST-VCLAB/color-brdfs-with-wave-optics"
# folders below output/250927/real, and ranges of sines (scripts/render_real.sh)
_MAPS = {
    "sigma=2.6_blur_sigma=0.65_0.01_0.8_anti_mirror_pixelsize=2_white_32": 0.3,
    "sigma=2.6_blur_sigma=0.65_0.006_0.8_aniso_anti_mirror_pixelsize=2_white_32": 0.4,
    "sigma=3.9_blur_sigma=0.65_0.01_0.8_note_pixelsize=2_white_32": 0.3,
}
_WAVELENGTHS = 420.0 + 260.0 * (np.arange(8) + 0.5) / 8
_LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
# pixels of heights along a pixel of the fabricated map; pictures' pixels, and each that is compared
_FINER, _PIXELS, _EVERY = 8, 64, 6


class Picture(NamedTuple):
    """Comparison of one picture's luminance with the reference.

    factor : of their luminance over that of a perfect reflector here.
    deviation : Σ|theirs − factor · ours| / Σ theirs.
    """

    name: str
    correlation: float
    factor: float
    deviation: float


def compare(clone: Path) -> list[Picture]:
    """Compare the maps of a clone of `REPOSITORY` with its pictures."""
    return [_compare(clone / "output/250927/real" / name, sines) for name, sines in _MAPS.items()]


def _compare(folder: Path, sines: float) -> Picture:
    found = re.match(r"sigma=([\d.]+).*_0\.8_(.*)_pixelsize=([\d.]+)", folder.name)
    assert found is not None
    sigma, name, pixel = float(found[1]), found[2], float(found[3])
    heights, theirs = (_read(folder, file) for file in ("hmap.exr", "scale=8_render.exr"))
    field = HeightField(np.ascontiguousarray(heights), pixel / _FINER, name=name, periodic=True)
    chosen = np.arange(2, _PIXELS, _EVERY)
    sine = ((chosen + 0.5) / _PIXELS * 2.0 - 1.0) * sines
    y, x = (part.ravel() for part in np.meshgrid(sine, sine, indexing="ij"))
    wo = np.stack([x, y, np.sqrt(1.0 - x * x - y * y)], axis=-1)
    luminous = colour.response(_WAVELENGTHS, "E")[:, 1]
    ours = np.zeros(len(wo))
    for lam, weight in zip(_WAVELENGTHS, luminous / luminous.sum(), strict=True):
        width = WIDTHS_PER_SIGMA * sigma / 0.5 * 1e-3 * lam
        ours += weight * reference.brdf(field, [0.0, 0.0, 1.0], wo, lam, coherence_width=width)
    seen = theirs[np.ix_(chosen, chosen)].ravel()
    factor = float(seen @ ours / (ours @ ours))
    deviation = float(np.abs(seen - factor * ours).sum() / seen.sum())
    return Picture(name, float(np.corrcoef(seen, ours)[0, 1]), factor, deviation)


def _read(folder: Path, name: str) -> Real:
    """Return heights in µm, or the luminance of a picture, from the newest run in a folder."""
    import mitsuba as mi

    if mi.variant() is None:
        mi.set_variant("scalar_rgb")
    path = sorted(folder.glob(f"sigma=*/{name}"))[-1]
    values = np.array(mi.Bitmap(str(path)), np.float64)
    return np.asarray(values if values.ndim == 2 else values @ _LUMINANCE)
