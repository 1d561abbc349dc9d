"""What `compare` found, as a Markdown table of the methods."""

from __future__ import annotations

import math
from typing import Any

_HEAD = (
    "| method | ΔE2000 mean | 99 % | FLIP | relative RMSE | frame, ms | fragment, ns "
    "| × `flss` | look-up, ns | textures, MB |\n|---|---|---|---|---|---|---|---|---|---|"
)


_WHOLE = (
    "| method | ΔE2000 mean | 99 % | noise | FLIP | relative RMSE | ΔE2000 to full light "
    "| frame, ms | × without shadows |\n|---|---|---|---|---|---|---|---|---|"
)


def markdown(document: dict[str, Any]) -> str:
    """The methods' tables, over all pixels and under lights without extent; how it was measured.

    Parameters
    ----------
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
    cells = (
        f"`{method}`",
        plain_number(direct["delta_e_mean"]),
        plain_number(direct["delta_e_percentiles"]["99"]),
        plain_number(found["noise"]["delta_e_mean"]),
        plain_number(direct["flip"]),
        plain_number(direct["relative_rmse"]),
        plain_number(full and full["delta_e_mean"]),
        plain_number(found["frame_ms"]),
        plain_number(found["frame_ms"] / found["plain_frame_ms"]),
    )
    return "| " + " | ".join(cells) + " |"


def _row(method: str, entry: dict[str, Any], slow: float | None) -> str:
    found = entry["diffracting"]
    cells = (
        f"`{method}`",
        plain_number(found["delta_e_mean"]),
        plain_number(found["delta_e_percentiles"].get("99")),
        plain_number(found["flip"]),
        plain_number(found["relative_rmse"]),
        plain_number(entry["frame_ms"]),
        plain_number(entry["fragment_ns"]),
        plain_number(slow / entry["fragment_ns"] if slow else None),
        plain_number(entry["look_up_ns"]),
        plain_number(entry["texture_bytes"] / 1e6),
    )
    return "| " + " | ".join(cells) + " |"


def plain_number(value: float | None) -> str:
    """Three digits at most, no more than two after the point, never with an exponent."""
    if value is None:
        return ""
    digits = 2 - math.floor(math.log10(value)) if value > 0.0 else 0
    digits = min(digits, 3 if value < 0.1 else 2)
    return f"{round(value, digits):.{max(digits, 0)}f}"
