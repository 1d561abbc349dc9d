"""What `compare` found, as a Markdown table of the methods."""

from __future__ import annotations

import math
from typing import Any

_HEAD = (
    "| method | ΔE2000 mean | 99 % | FLIP | relative RMSE | frame, ms | fragment, ns "
    "| × `flss` | look-up, ns | textures, MB |\n|---|---|---|---|---|---|---|---|---|---|"
)


def markdown(document: dict[str, Any]) -> str:
    """The methods' table, and what it was measured with.

    Parameters
    ----------
    document : what is in compare.json.
    """
    slow = document["methods"].get("flss", {}).get("fragment_ns")
    rows = [_row(method, entry, slow) for method, entry in document["methods"].items()]
    share = next(iter(document["methods"].values()))["diffracting"]["share"]
    width, height = document["size"]
    return "\n".join(
        [
            _HEAD,
            *rows,
            "",
            f"{100 * share:.0f} % of {width} × {height} pixels, those that diffract and are lit in "
            f"both; {document['driver']}; noise of the path-traced picture: ΔE2000 "
            f"{plain_number(document['noise_delta_e_mean'])}.",
        ]
    )


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
