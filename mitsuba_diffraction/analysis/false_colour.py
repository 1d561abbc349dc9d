"""False-colour pictures of a film whose channels are an animal's receptors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..arrays import Real
from ..optics.colour import encode_srgb
from .observers import GRID, Eye, responses

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Height of a picture at most, inches: of narrower ones than 1 : 10 the figure needs gigabytes.
_TALLEST = 60.0
# Share of the pixels that are brighter than white.
_WHITE = 0.02
# Colours of curves that are shown as red, green and blue, and of one that is not shown.
_CURVES, _UNSHOWN = ("tab:red", "tab:green", "tab:blue"), "0.7"


def shown_receptors(count: int) -> list[tuple[int, int, int]]:
    """Return which receptors are red, green and blue in each picture of an eye of so many.

    Two are yellow and blue, three are red to blue; four, the shortest wavelength first, have two
    pictures: the three longest as we see them, and the three shortest, with ultraviolet as blue.
    """
    if count == 2:
        return [(1, 1, 0)]
    return [(n + 2, n + 1, n) for n in reversed(range(count - 2))]


def adapted(channels: Real) -> Real:
    """Return catches (h, w, receptors) over each receptor's mean over the picture.

    Receptors without light stay 0.
    """
    mean = channels.mean(axis=(0, 1))
    return np.asarray(channels / np.where(mean > 0.0, mean, 1.0))


def false_colour_figure(channels: Real, eye: Eye, exposure: float = 0.0, title: str = "") -> Figure:
    """Draw pictures in false colour above the responses of the receptors that they show.

    Each receptor is adapted to the mean of the picture, as after von Kries.

    channels : (h, w, receptors), catches of a film; exposure : in stops.
    """
    from matplotlib.figure import Figure

    light = adapted(channels)
    white = 2.0**-exposure * max(float(np.quantile(light.max(axis=2), 1.0 - _WHITE)), 1e-30)
    pictures = shown_receptors(channels.shape[2])
    height = min(6.0 * channels.shape[0] / channels.shape[1], _TALLEST)
    figure = Figure(figsize=(6.0 * len(pictures), height + 1.8), dpi=120, layout="constrained")
    rows = figure.subplots(2, len(pictures), squeeze=False, height_ratios=(height, 1.5))
    curves = responses(eye) / responses(eye).max(axis=1, keepdims=True)
    for (picture, legend), receptors in zip(rows.T, pictures, strict=True):
        picture.imshow(encode_srgb(np.clip(light[..., receptors] / white, 0.0, 1.0)))
        picture.set_axis_off()
        shown = dict(zip(receptors, _CURVES, strict=True))
        for n, curve in enumerate(curves):
            legend.plot(GRID, curve, color=shown.get(n, _UNSHOWN), label=eye.names[n])
            legend.text(GRID[curve.argmax()], 1.02, eye.names[n], ha="center", fontsize=8)
        legend.set(xlabel="wavelength (nm)", ylabel="response", ylim=(0.0, 1.2))
    figure.suptitle(f"{title}, each receptor adapted to the mean of the picture", fontsize=9)
    return figure
