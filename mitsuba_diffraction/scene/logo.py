"""Logos as holograms: areas of colour in a picture, and the gratings that show their colours.

A grating of period Λ sends the wavelength Λ L in its first order, where L is the length of the
tangential part of ω_i + ω_o across its grooves. A hue that no wavelength has, such as purple or
white, is a mosaic of dots of two or three periods.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from scipy.ndimage import distance_transform_edt, grey_dilation, grey_erosion

from ..arrays import Real
from ..errors import DiffractionError
from ..images import read_picture
from ..optics.colour import decode_srgb, linear_srgb, response
from .hologram import Hologram, hologram

Labels = NDArray[np.intp]

#: Wavelengths, nm, of the pure hues, and of the dots that mix white and purple.
HUES = (445.0, 640.0)
WHITE, PURPLE = (465.0, 540.0, 610.0), (455.0, 630.0)
# Levels of 8 bits: differences within an area, between two colours of a palette, and of black
_EVEN, _DISTINCT, _BLACK = 10, 48, 30
# Least part of the picture that is even, so that its even pixels alone give the palette; least part
# that a colour covers; part of the border that one colour covers where it is the ground
_MOSTLY, _LEAST, _GROUND = 0.2, 0.001, 0.6
# Least saturation, of white 0 and of a pure colour 1, and degrees around white to the nearest hue
_GREY, _PURE = 0.15, 8.0


class Areas(NamedTuple):
    """Areas of colour of a picture.

    Attributes
    ----------
    labels : (ny, nx), row 0 at the top; 0 where there is no grating, else the number of a colour.
    colours : (n, 3) sRGB of the labels 1 to n, 0 to 255, most frequent first.
    """

    labels: Labels
    colours: Real


def areas(file: Path, *, colours: int = 6, dots: int = 512, keep_ground: bool = False) -> Areas:
    """Divide a picture into areas of a few colours.

    Pixels of blended colour along edges take the colour of one of the two sides. Without a grating
    are transparent pixels, black, and in pictures without transparency the ground: the colour of
    most of the border.

    Parameters
    ----------
    file : a picture that Pillow reads.
    colours : largest number of colours.
    dots : pixels along the longer side, to which the picture is enlarged or reduced.
    keep_ground : make the ground a colour like others.

    Raises a DiffractionError if the file is no picture, or has no colour but its ground.
    """
    picture = _read(file, dots)
    rgb, opaque = picture[..., :3].astype(float), picture[..., 3] > 127
    if not opaque.any():
        raise DiffractionError(f"'{file}' is transparent everywhere; a logo needs opaque pixels")
    spread = [grey_dilation(c, (3, 3)) - grey_erosion(c, (3, 3)) for c in np.moveaxis(rgb, -1, 0)]
    even = opaque & (np.max(spread, axis=0) <= _EVEN)
    if even.sum() < _MOSTLY * opaque.sum():  # a photograph, or fine lines
        even = opaque
    palette = _palette(rgb[even], colours + 1)
    labels = _nearest(rgb, palette, even)
    labels[~opaque] = -1
    blank = palette.max(axis=1) < _BLACK
    if opaque.all() and not keep_ground:
        border = np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]])
        counts = np.bincount(border, minlength=len(palette))
        blank[counts.argmax()] |= counts.max() > _GROUND * border.size
    order = [n for n in np.argsort(-np.bincount(labels[opaque], minlength=len(palette)))
             if not blank[n] and (labels == n).any()][:colours]  # fmt: skip
    if not order:
        raise DiffractionError(
            f"'{file}' has no colour beside its ground or black; a logo needs a second colour, or "
            "transparency around it"
        )
    numbers = np.zeros(len(palette) + 1, np.intp)  # the last stands for -1
    numbers[order] = np.arange(1, len(order) + 1)
    return Areas(numbers[labels], palette[order])


def _read(file: Path, dots: int) -> NDArray[np.uint8]:
    """Return RGBA (ny, nx, 4) with so many pixels along the longer side."""
    rgba = read_picture(file).convert("RGBA")
    scale = dots / max(rgba.size)
    width, height = (max(1, round(scale * length)) for length in rgba.size)
    return np.asarray(rgba.resize((width, height), Image.Resampling.BICUBIC))


def _palette(colours: Real, most: int) -> Real:
    """Return the most frequent of distinct colours (n, 3), at most `most`."""
    row = Image.fromarray(colours[None].astype(np.uint8))
    reduced = row.quantize(64, Image.Quantize.MEDIANCUT)
    table = np.array(reduced.getpalette() or [], float).reshape(-1, 3)
    counts = np.bincount(np.asarray(reduced).ravel(), minlength=len(table))
    chosen: list[Real] = []
    for n in np.argsort(-counts):
        if counts[n] < _LEAST * len(colours) or len(chosen) == most:
            break
        if all(np.linalg.norm(table[n] - other) > _DISTINCT for other in chosen):
            chosen.append(table[n])
    return np.array(chosen or [table[counts.argmax()]])


def _nearest(rgb: Real, palette: Real, even: NDArray[np.bool_]) -> Labels:
    """Return the number of each pixel's colour; of blended pixels, a colour of the areas beside."""
    distance = np.linalg.norm(rgb[..., None, :] - palette, axis=-1)
    sure = distance.argmin(axis=-1)
    away = np.stack([
        distance_transform_edt(~(even & (sure == n))) if (even & (sure == n)).any()
        else np.full(sure.shape, np.inf)
        for n in range(len(palette))
    ], axis=-1)  # fmt: skip
    beside = away <= away.min(axis=-1, keepdims=True) + 2.0
    blended = np.where(beside, distance, np.inf).argmin(axis=-1)
    return np.asarray(np.where(even, sure, blended))


def wavelengths_of(colour: Real) -> tuple[float, ...]:
    """Return the wavelengths, nm, whose mixture has the hue of a colour (3,), sRGB 0 to 255."""
    if np.ptp(colour) < _GREY * colour.max():
        return WHITE
    to_xyz = np.linalg.inv(linear_srgb(np.eye(3)))
    spectrum = np.arange(*HUES)
    around = _angle(response(spectrum, "E")) - _angle(decode_srgb(colour / 255.0) @ to_xyz)
    turn = np.abs((around + 180.0) % 360.0 - 180.0)
    return (float(spectrum[turn.argmin()]),) if turn.min() < _PURE else PURPLE


def _angle(xyz: Real) -> Real:
    """Return the angle of chromaticities (…, 3) around white, degrees."""
    white = np.array([0.3127, 0.3290])
    x, y = np.moveaxis(xyz[..., :2] / xyz.sum(axis=-1, keepdims=True) - white, -1, 0)
    return np.degrees(np.arctan2(y, x))


def logo(parts: Areas, *, tangential: Real, orientation: float, period: float) -> Hologram:
    """Return the textures of the gratings that show the colours, with a blank margin.

    Dark colours have a lower weight.

    parts : of `areas`.
    tangential : (n,) lengths of the tangential part of ω_i + ω_o, evenly from the lower to the
        upper edge.
    orientation : degrees from the surface's first tangent to that part's direction.
    period : of the patch, µm.
    """
    ny, nx = parts.labels.shape
    periods, weights = np.full((ny, nx), np.nan), np.zeros((ny, nx))
    mosaic = np.add.outer(2 * np.arange(ny), np.arange(nx))
    up = 1.0 - (np.arange(ny) + 0.5) / ny
    rows = np.interp(up, np.linspace(0.0, 1.0, len(tangential)), tangential)[:, None]
    for number, colour in enumerate(parts.colours, 1):
        shown = np.array(wavelengths_of(colour)) * 1e-3
        here = parts.labels == number
        periods[here] = (shown[mosaic % len(shown)] / rows)[here]
        weights[here] = colour.max() / 255.0
    foil = hologram(
        np.pad(np.isfinite(periods), 1), periods=np.pad(periods, 1, constant_values=np.nan),
        orientations=orientation, period=period,
    )  # fmt: skip
    return replace(foil, weight=np.pad(weights, 1).astype(np.float32))
