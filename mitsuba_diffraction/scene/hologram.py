"""Textures of dot-matrix holograms (kinegrams): gratings whose direction and period vary.

Each dot of such a foil is a small grating with a direction and a period of its own (R. L. van
Renesse, Optical Document Security, Artech House 2005). One patch of heights serves them all:
`orientation` turns it, and `lateral_scale` stretches its period.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image

from ..arrays import Single
from ..atomic import atomic_path
from ..errors import DiffractionError, quoted
from ..images import read_picture
from ..plugin.memory import tensor
from ..tables import write_channels

#: Quantity of the dots: of each label, from black to white, at each dot, or of all.
Values = Mapping[int, float] | tuple[float, float] | NDArray[np.floating[Any]] | float

#: Bounds of periods, µm: shorter ones diffract no visible light, longer ones show no colours.
PERIODS = (0.1, 100.0)
#: Texels of the largest texture.
MOST_TEXELS = 2**26


class Files(NamedTuple):
    """Paths of the textures that `Hologram.write` wrote."""

    orientation: Path
    lateral_scale: Path
    weight: Path

    @classmethod
    def called(cls, folder: Path, stem: str) -> Files:
        """Return the paths in a folder, of names that begin with the stem."""
        names = "orientation.exr", "lateral_scale.exr", "weight.png"
        return cls(*(folder / f"{stem}_{name}" for name in names))


@dataclass(frozen=True, eq=False)
class Hologram:
    """Textures of a hologram, row 0 at the top.

    Attributes
    ----------
    orientation : (ny, nx, 3), (cos, sin, 0) of the direction across the grooves.
    lateral_scale : (ny, nx), period over `period`.
    weight : (ny, nx), 1 where there is a grating, else 0, for `diffraction_mix`.
    period : period of the patch, µm, for which lateral_scale is 1.
    """

    orientation: Single
    lateral_scale: Single
    weight: Single
    period: float

    def parameters(self) -> dict[str, Any]:
        """Return `orientation` and `lateral_scale` for `bsdf_dict`, in the current variant."""
        return {
            "orientation": _texture(self.orientation),
            "lateral_scale": _texture(self.lateral_scale[..., None]),
        }

    def mix(self, grating: dict[str, Any], blank: dict[str, Any]) -> dict[str, Any]:
        """Return a `diffraction_mix` of the gratings and the foil between them.

        grating : BSDF with `parameters`; blank : BSDF without a grating.
        """
        weight = _texture(self.weight[..., None])
        return {
            "type": "diffraction_mix",
            "grating": grating,
            "blank": blank,
            "weight_grating": weight,
        }

    def write(self, folder: str | os.PathLike[str], stem: str = "hologram") -> Files:
        """Write the textures as STEM_orientation.exr, STEM_lateral_scale.exr and STEM_weight.png.

        Raises a DiffractionError if the folder does not exist or cannot be written to.
        """
        files = Files.called(Path(folder), stem)
        parts = np.moveaxis(self.orientation.astype(np.float16), -1, 0)
        write_channels(files.orientation, dict(zip("RGB", parts, strict=True)))
        write_channels(files.lateral_scale, {"Y": self.lateral_scale.astype(np.float16)})
        levels = np.round(self.weight * 255.0).astype(np.uint8)
        with atomic_path(files.weight) as temporary:
            Image.fromarray(levels).save(temporary, optimize=True)
        return files


def hologram(
    image: ArrayLike | str | os.PathLike[str],
    *,
    periods: Values,
    orientations: Values,
    period: float | None = None,
    dot: int = 1,
) -> Hologram:
    """Make the textures of a dot-matrix hologram from a picture; each of its pixels is a dot.

    Raises a DiffractionError if the picture cannot be read, a period or angle is not allowed, or no
    dot has a grating.

    Parameters
    ----------
    image
        File (PNG, BMP, TIFF; grey or with a palette), or array (ny, nx). Its numbers are labels, or
        brightness: of files and integers over the largest integer, of floats from 0 to 1.
    periods
        Periods of the gratings, µm, 0.1 to 100. A mapping gives the period of each label. A pair
        gives the periods of black and of white, in proportion between. An array (ny, nx) gives the
        periods of dots, a number one period.
    orientations
        Degrees from the surface's first tangent to the direction across the grooves, in which light
        is spread; given as the periods are.
    period
        Period, µm, of the heights that are stretched; by default the longest of all dots.
    dot
        Texels across a dot. Dots of 1 texel are squares that touch, larger ones are round.

    Returns
    -------
    Hologram
        Its weight is 0 where a mapping has no entry for a label, where a picture of brightness is
        black, where an array is NaN, and between round dots.
    """
    values, full_scale = _picture(image)
    labels = isinstance(periods, Mapping) or isinstance(orientations, Mapping)
    if labels and any(isinstance(quantity, tuple) for quantity in (periods, orientations)):
        raise DiffractionError(
            "hologram: periods and orientations must both be of labels (mappings) or both of "
            "brightness (pairs)"
        )
    lengths = _of_dots("periods", periods, values, full_scale)
    angles = _of_dots("orientations", orientations, values, full_scale)
    lit = np.isfinite(lengths) & np.isfinite(angles)
    if not labels:
        lit &= values > 0
    if not lit.any():
        raise DiffractionError("hologram: no dot has a grating; check labels and periods")
    shortest, longest = float(lengths[lit].min()), float(lengths[lit].max())
    base = longest if period is None else float(period)
    for name, value in (("periods", shortest), ("periods", longest), ("period", base)):
        if not PERIODS[0] <= value <= PERIODS[1]:
            raise DiffractionError(
                f"hologram: {name}={value:g} must be between {PERIODS[0]:g} and {PERIODS[1]:g} µm"
            )
    turns = np.radians(np.where(lit, angles, 0.0))
    across = np.stack([np.cos(turns), np.sin(turns), np.zeros_like(turns)], axis=-1)
    disc = _disc(dot, values.size)
    texels, scale = np.ones(disc.shape), np.where(lit, lengths, base) / base
    return Hologram(
        np.kron(across, texels[..., None]).astype(np.float32),
        np.kron(scale, texels).astype(np.float32),
        np.kron(lit, disc).astype(np.float32),
        base,
    )


def _picture(image: ArrayLike | str | os.PathLike[str]) -> tuple[NDArray[Any], float]:
    """Return numbers (ny, nx) of a picture, and the number of white."""
    picture = read_picture(Path(image)) if isinstance(image, str | os.PathLike) else image
    values = np.asarray(picture)
    if isinstance(picture, Image.Image) and values.ndim != 2:
        raise DiffractionError(
            f"hologram: '{image!s}' has colours ({picture.mode}); save it in grey, or with a "
            "palette whose indices are labels"
        )
    if values.ndim != 2 or values.size == 0 or values.dtype.kind not in "buif":
        raise DiffractionError(
            f"hologram: expected an array (ny, nx) of numbers, got shape {values.shape} of "
            f"{values.dtype}"
        )
    if values.dtype.kind == "f":
        if not (np.isfinite(values).all() and values.min() >= 0.0 and values.max() <= 1.0):
            raise DiffractionError("hologram: brightness must be between 0 and 1")
        return values, 1.0
    return values, 1.0 if values.dtype.kind == "b" else float(np.iinfo(values.dtype).max)


def _of_dots(
    name: str, given: Values, values: NDArray[Any], full_scale: float
) -> NDArray[np.float64]:
    """Return a quantity at the dots (ny, nx), or NaN."""
    if isinstance(given, Mapping) and values.dtype.kind == "f":
        raise DiffractionError(f"hologram: {name} of labels need a picture of integers")
    try:
        if isinstance(given, Mapping):
            numbers, dots = list(map(float, given.values())), np.full(values.shape, np.nan)
            for label, number in zip(given, numbers, strict=True):
                dots[values == label] = number
        elif isinstance(given, tuple):
            numbers = black, white = [float(end) for end in given]
            dots = black + (white - black) * (values / full_scale)
        else:
            dots = np.broadcast_to(np.asarray(given, float), values.shape)
            numbers = [] if np.ndim(given) else [float(dots.flat[0])]
    except (TypeError, ValueError):
        raise DiffractionError(
            f"hologram: {name}={quoted(given)} must be a mapping from labels, a pair of black and "
            f"white, an array {values.shape}, or a number"
        ) from None
    if wrong := [number for number in numbers if not np.isfinite(number)]:
        raise DiffractionError(f"hologram: {name}: {wrong[0]} must be a finite number")
    return np.asarray(dots, np.float64)


def _disc(texels: int, dots: int) -> NDArray[np.bool_]:
    """Return the texels (n, n) of a round dot."""
    most = int(np.sqrt(MOST_TEXELS / dots))
    if isinstance(texels, bool) or not isinstance(texels, int) or not 1 <= texels <= most:
        raise DiffractionError(f"hologram: dot={texels} must be a whole number from 1 to {most}")
    offset = (np.arange(texels) + 0.5) / texels - 0.5
    return np.hypot(*np.meshgrid(offset, offset)) <= 0.5 if texels > 1 else np.ones((1, 1), bool)


def _texture(values: Single) -> dict[str, Any]:
    """Return a bitmap without interpolation: a mean of two gratings would be a wrong grating."""
    return {"type": "bitmap", "raw": True, "filter_type": "nearest", "data": tensor(values)}
