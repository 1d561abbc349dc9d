"""Report of a comparison: a sheet of pictures for each method, and a Markdown table of all."""

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

# times are ratios: those of one machine, and of a busy one, say little; compare.json has them in ms
_HEAD = (
    "| method | ΔE2000 mean | 99 % | FLIP | relative RMSE | frame, × `{first}` "
    "| fragment, × `{first}` | × `flss` | look-up in a fragment | textures, MB |\n"
    "|---|---|---|---|---|---|---|---|---|---|"
)

_WHOLE = (
    "| method | ΔE2000 mean | 99 % | noise | FLIP | relative RMSE | ΔE2000 to full light "
    "| frame, × `{first}` | × without shadows |\n|---|---|---|---|---|---|---|---|---|"
)


def write_sheet(
    path: Path,
    reference: Image,
    other: Image,
    full: Image | None,
    *,
    method: str,
    errors: Difference,
    compared: NDArray[np.bool_] | None,
    exposure: float,
) -> None:
    """Write a sheet: both pictures, their difference, and full transport.

    Raises a DiffractionError if the file cannot be written.

    Parameters
    ----------
    path : image file.
    reference, other : direct light, path-traced and of the shader, linear sRGB (height, width, 3).
    full : full transport, or None.
    method : method of the shader.
    errors : difference over the compared pixels.
    compared : compared pixels; the map is pale elsewhere. None for all.
    exposure : factor on all pictures.
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
    distances = delta_e(reference, other, exposure=exposure, least=least)
    shown = axes[1, 0].imshow(
        np.nan_to_num(distances), cmap="magma", vmin=0.0, vmax=_WORST,
        alpha=None if compared is None else np.where(compared, 1.0, 0.25),
    )  # fmt: skip
    high = errors.delta_e_percentiles["99"]
    title = f"difference, mean {errors.delta_e_mean:.2f}, 99 % {high:.1f}"
    if compared is not None:
        title += "\n(pale where shadows, edges and materials differ)"
    axes[1, 0].set_title(title, fontsize="medium")
    figure.colorbar(shown, ax=axes[1, 0], label="ΔE2000", extend="max", shrink=0.8)
    for axis in axes.ravel():
        axis.set_axis_off()
    with atomic_path(path) as temporary:
        figure.savefig(temporary, format=path.suffix.lower().lstrip("."))


def markdown(document: dict[str, Any]) -> str:
    """Return the methods' tables over all pixels and under points and directions, with notes.

    document : content of compare.json.
    """
    methods = document["methods"]
    first = next(iter(methods))
    slow = methods.get("flss", {}).get("fragment_ns")
    rows = [_row(method, entry, methods[first], slow) for method, entry in methods.items()]
    lit = {method: entry for method, entry in methods.items() if "whole" in entry}
    whole = [_whole_row(m, entry, next(iter(lit.values()))) for m, entry in lit.items()]
    share = methods[first]["diffracting"]["share"]
    width, height = document["size"]
    head = _WHOLE.format(first=next(iter(lit), first))
    return "\n".join(
        [
            *([head, *whole, ""] if whole else []),
            f"All {width} × {height} pixels in all direct light, {document['frames']} frames of "
            f"{_samples(document)} samples a pixel, against {document['spp']} of the path tracer; "
            f"{100 * document['clipped']:.1f} % of the pixels are clipped.",
            *_dark_regions(lit),
            "",
            _HEAD.format(first=first),
            *rows,
            "",
            f"Lights without extent, no shadows: {100 * share:.0f} % of the pixels, those that "
            f"diffract and are lit in both; {document['driver']}; noise of the path tracer: "
            f"ΔE2000 {plain_number(document['noise_delta_e_mean'])}.",
        ]
    )


def _dark_regions(methods: dict[str, Any]) -> list[str]:
    """Return a sentence on regions that light between surfaces leaves dark, where measured."""
    shares = [
        f"{plain_number(100.0 * entry['whole']['dark_region'])} % by `{method}`"
        for method, entry in methods.items()
        if entry["whole"].get("dark_region") is not None
    ]
    if not shares:
        return []
    return [
        "",
        "With light between surfaces, largest region of the picture less than half as bright as in "
        f"full transport: {', '.join(shares)}.",
    ]


def _samples(document: dict[str, Any]) -> int:
    """Return the samples per pixel in one progressive frame."""
    samples = [e["whole"]["samples"] for e in document["methods"].values() if "whole" in e]
    return int(max(samples, default=0) / document["frames"])


def _whole_row(method: str, entry: dict[str, Any], first: dict[str, Any]) -> str:
    """Return the row of a method in progressive light, over all pixels; first : for times."""
    whole = entry["whole"]
    direct, full = whole["direct"], whole["full"]
    return _line(
        method, direct["delta_e_mean"], direct["delta_e_percentiles"]["99"],
        whole["noise"]["delta_e_mean"], direct["flip"], direct["relative_rmse"],
        full and full["delta_e_mean"], whole["frame_ms"] / first["whole"]["frame_ms"],
        whole["frame_ms"] / whole["plain_frame_ms"],
    )  # fmt: skip


def _row(method: str, entry: dict[str, Any], first: dict[str, Any], slow: float | None) -> str:
    """Return the row of a method under points and directions, over diffracting pixels.

    first : method whose times are 1.
    slow : time of a fragment of `flss`, ns, or None.
    """
    errors = entry["diffracting"]
    return _line(
        method, errors["delta_e_mean"], errors["delta_e_percentiles"].get("99"), errors["flip"],
        errors["relative_rmse"], *(entry[n] / first[n] for n in ("frame_ms", "fragment_ns")),
        slow / entry["fragment_ns"] if slow else None, entry["look_up_ns"] / entry["fragment_ns"],
        entry["texture_bytes"] / 1e6,
    )  # fmt: skip


def _line(method: str, *values: float | None) -> str:
    """Return a line of a Markdown table."""
    return "| " + " | ".join([f"`{method}`", *map(plain_number, values)]) + " |"


def plain_number(value: float | None) -> str:
    """Format a number with at most three digits, two after the point, and no exponent."""
    if value is None:
        return ""
    digits = 2 - math.floor(math.log10(value)) if value > 0.0 else 0
    digits = min(digits, 3 if value < 0.1 else 2)
    return f"{round(value, digits):.{max(digits, 0)}f}"
