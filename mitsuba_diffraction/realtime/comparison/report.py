"""What a comparison found: a sheet of pictures for each method, and all methods as Markdown."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...atomic import atomic_path
from ...optics.colour import delta_e, encode_srgb
from .measures import Difference, Image

_WORST = 8.0  # ΔE2000 at the end of the scale

_HEAD = (
    "| method | ΔE2000 mean | 99 % | FLIP | relative RMSE | frame, ms | fragment, ns "
    "| × `flss` | look-up, ns | textures, MB |\n|---|---|---|---|---|---|---|---|---|---|"
)

_WHOLE = (
    "| method | ΔE2000 mean | 99 % | noise | FLIP | relative RMSE | ΔE2000 to full light "
    "| frame, ms | × without shadows |\n|---|---|---|---|---|---|---|---|---|"
)


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

    path : an image file.
    reference, other : direct light, path-traced and of the shader, linear sRGB (height, width, 3).
    full : full transport, or None.
    method : of the shader.
    found : over the pixels that count.
    compared : those pixels, the map being pale elsewhere; None for all.
    exposure : factor on all pictures.

    Raises a DiffractionError if it cannot be written.
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


def markdown(document: dict[str, Any]) -> str:
    """The methods' tables, over all pixels and under lights without extent; how it was measured.

    document : what is in compare.json.
    """
    slow = document["methods"].get("flss", {}).get("fragment_ns")
    rows = [_row(method, entry, slow) for method, entry in document["methods"].items()]
    whole = [_whole_row(m, entry) for m, entry in document["methods"].items() if "whole" in entry]
    share = next(iter(document["methods"].values()))["diffracting"]["share"]
    width, height = document["size"]
    return "\n".join(
        [
            *([_WHOLE, *whole, ""] if whole else []),
            f"All {width} × {height} pixels in all direct light, {document['frames']} frames of "
            f"{_samples(document)} samples a pixel, against {document['spp']} of the path tracer; "
            f"{100 * document['clipped']:.1f} % of the pixels are clipped.",
            "",
            _HEAD,
            *rows,
            "",
            f"Lights without extent, no shadows: {100 * share:.0f} % of the pixels, those that "
            f"diffract and are lit in both; {document['driver']}; noise of the path tracer: "
            f"ΔE2000 {plain_number(document['noise_delta_e_mean'])}.",
        ]
    )


def _samples(document: dict[str, Any]) -> int:
    """Of a pixel in a progressive frame."""
    taken = [e["whole"]["samples"] for e in document["methods"].values() if "whole" in e]
    return int(max(taken, default=0) / document["frames"])


def _whole_row(method: str, entry: dict[str, Any]) -> str:
    found = entry["whole"]
    direct, full = found["direct"], found["full"]
    return _line(
        method, direct["delta_e_mean"], direct["delta_e_percentiles"]["99"],
        found["noise"]["delta_e_mean"], direct["flip"], direct["relative_rmse"],
        full and full["delta_e_mean"], found["frame_ms"],
        found["frame_ms"] / found["plain_frame_ms"],
    )  # fmt: skip


def _row(method: str, entry: dict[str, Any], slow: float | None) -> str:
    found = entry["diffracting"]
    return _line(
        method, found["delta_e_mean"], found["delta_e_percentiles"].get("99"), found["flip"],
        found["relative_rmse"], entry["frame_ms"], entry["fragment_ns"],
        slow / entry["fragment_ns"] if slow else None, entry["look_up_ns"],
        entry["texture_bytes"] / 1e6,
    )  # fmt: skip


def _line(method: str, *values: float | None) -> str:
    return "| " + " | ".join([f"`{method}`", *map(plain_number, values)]) + " |"


def plain_number(value: float | None) -> str:
    """Three digits at most, no more than two after the point, never with an exponent."""
    if value is None:
        return ""
    digits = 2 - math.floor(math.log10(value)) if value > 0.0 else 0
    digits = min(digits, 3 if value < 0.1 else 2)
    return f"{round(value, digits):.{max(digits, 0)}f}"
