"""Report of a comparison: a sheet of pictures for each method, and a Markdown table of all."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import counted
from ...images import save_figure
from ...optics.colour import delta_e, encode_srgb
from .measures import Difference, Image

_WORST = 8.0  # ΔE2000 at the end of the scale

# times are ratios: those of one machine, and of a busy one, say little; compare.json has them in ms
_HEAD = (
    "| method | ΔE2000 mean | 99 % | noise | FLIP | relative RMSE | ΔE2000 to full light "
    "| frame, × `{first}` | fragment, × `{first}` | textures, MB |\n"
    "|---|---|---|---|---|---|---|---|---|---|"
)


def write_sheet(
    path: Path,
    reference: Image,
    other: Image,
    full: Image | None,
    *,
    method: str,
    errors: Difference,
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
    errors : their difference.
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
    distances = delta_e(reference, other, exposure=exposure, least=0.0)
    shown = axes[1, 0].imshow(distances, cmap="magma", vmin=0.0, vmax=_WORST)
    high = errors.delta_e_percentiles["99"]
    title = f"difference, mean {errors.delta_e_mean:.2f}, 99 % {high:.1f}"
    axes[1, 0].set_title(title, fontsize="medium")
    figure.colorbar(shown, ax=axes[1, 0], label="ΔE2000", extend="max", shrink=0.8)
    for axis in axes.ravel():
        axis.set_axis_off()
    save_figure(path, figure)


def markdown(document: dict[str, Any]) -> str:
    """Return the table of the methods, with notes.

    document : content of compare.json.
    """
    methods = document["methods"]
    first, of_first = next(iter(methods.items()))
    width, height = document["size"]
    samples = max(entry["samples"] for entry in methods.values()) // document["frames"]
    dark = [
        f"{plain_number(100.0 * entry['dark_region'])} % by `{method}`"
        for method, entry in methods.items()
        if entry["dark_region"] is not None
    ]
    lines = [
        _HEAD.format(first=first),
        *(_row(method, entry, of_first) for method, entry in methods.items()),
        "",
        f"All {width} × {height} pixels in all direct light, {document['frames']} frames of "
        f"{counted(samples, 'sample')} a pixel, against {document['spp']} of the path tracer, "
        f"whose noise is ΔE2000 {plain_number(document['noise']['delta_e_mean'])}; "
        f"{document['driver']}; {100 * document['clipped']:.1f} % of the pixels are clipped.",
    ]
    if dark:
        lines += [
            "",
            "With light between surfaces, largest region of the picture less than half as bright "
            f"as in full transport: {', '.join(dark)}.",
        ]
    return "\n".join(lines)


def _row(method: str, entry: dict[str, Any], first: dict[str, Any]) -> str:
    """Return the row of a method; first : entry of the method whose times are 1."""
    direct, full = entry["direct"], entry["full"]
    values = (
        direct["delta_e_mean"], direct["delta_e_percentiles"]["99"],
        entry["noise"]["delta_e_mean"], direct["flip"], direct["relative_rmse"],
        full and full["delta_e_mean"], *(entry[n] / first[n] for n in ("frame_ms", "fragment_ns")),
        entry["texture_bytes"] / 1e6,
    )  # fmt: skip
    return "| " + " | ".join([f"`{method}`", *map(plain_number, values)]) + " |"


def plain_number(value: float | None) -> str:
    """Format a number with at most three digits, two after the point, and no exponent."""
    if value is None:
        return ""
    digits = 2 - math.floor(math.log10(value)) if value > 0.0 else 0
    digits = min(digits, 3 if value < 0.1 else 2)
    return f"{round(value, digits):.{max(digits, 0)}f}"
