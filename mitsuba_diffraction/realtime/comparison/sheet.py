"""A picture of a comparison: path-traced, realtime, where they differ, what realtime leaves out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...atomic import atomic_path
from ...optics.colour import delta_e, encode_srgb
from .measures import Difference, Image

_WORST = 8.0  # ΔE2000 at the end of the scale


def write_sheet(
    path: Path,
    reference: Image,
    other: Image,
    full: Image | None,
    *,
    method: str,
    found: Difference,
    compared: NDArray[np.bool_] | None,
    exposure: float,
) -> None:
    """Write the sheet.

    Parameters
    ----------
    path : an image file.
    reference, other : direct light, path-traced and of the shader, linear sRGB (height, width, 3).
    full : full transport, or None.
    method : of the shader.
    found : over the pixels that count.
    compared : those pixels, the map being pale elsewhere; None for all.
    exposure : factor on all pictures.

    Raises
    ------
    DiffractionError
        If it cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    height, width = reference.shape[:2]
    figure = Figure(figsize=(10.0, 0.7 + 9.4 * height / width), layout="constrained", dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2)
    pictures = [(axes[0, 0], reference, "path-traced, direct light"), (axes[0, 1], other, method)]
    if full is not None:
        pictures.append((axes[1, 1], full, "path-traced, all light of the scene"))
    for axis, image, title in pictures:
        axis.imshow(encode_srgb(exposure * np.asarray(image, float)))
        axis.set_title(title)
    least = 0.0 if compared is None else 0.01
    errors = delta_e(reference, other, exposure=exposure, least=least)
    shown = axes[1, 0].imshow(
        np.nan_to_num(errors), cmap="magma", vmin=0.0, vmax=_WORST,
        alpha=None if compared is None else np.where(compared, 1.0, 0.25),
    )  # fmt: skip
    title = f"difference, mean {found.delta_e_mean:.2f}, 99 % {found.delta_e_percentiles['99']:.1f}"
    if compared is not None:
        title += "\n(pale where shadows, edges and materials differ)"
    axes[1, 0].set_title(title, fontsize="medium")
    figure.colorbar(shown, ax=axes[1, 0], label="ΔE2000", extend="max", shrink=0.8)
    for axis in axes.ravel():
        axis.set_axis_off()
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format=path.suffix.lower().lstrip("."))
