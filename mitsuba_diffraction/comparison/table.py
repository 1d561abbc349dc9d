"""What `compare` found, as a Markdown table of the methods."""

from __future__ import annotations

import math
from typing import Any

_HEAD = (
    "| method | ΔE2000 mean | 99 % | FLIP | relative RMSE | frame, ms | look-up, ns "
    "| textures, MB |\n|---|---|---|---|---|---|---|---|"
)


def markdown(document: dict[str, Any]) -> str:
    """The methods' table, and what it was measured with.

    Parameters
    ----------
    document : what is in compare.json.
    """
    rows = [_row(method, entry) for method, entry in document["methods"].items()]
    share = next(iter(document["methods"].values()))["diffracting"]["share"]
    width, height = document["size"]
    return "\n".join(
        [
            _HEAD,
            *rows,
            "",
            f"{100 * share:.0f} % of {width} × {height} pixels, those that diffract and are lit in "
            f"both; {document['driver']}; noise of the path-traced picture: ΔE2000 "
            f"{_plain(document['noise_delta_e_mean'])}.",
        ]
    )


def _row(method: str, entry: dict[str, Any]) -> str:
    found = entry["diffracting"]
    cells = (
        f"`{method}`",
        _plain(found["delta_e_mean"]),
        _plain(found["delta_e_percentiles"].get("99")),
        _plain(found["flip"]),
        _plain(found["relative_rmse"]),
        _plain(entry["frame_ms"]),
        _plain(entry["fragment_ns"]),
        _plain(entry["texture_bytes"] / 1e6),
    )
    return "| " + " | ".join(cells) + " |"


def _plain(value: float | None) -> str:
    """Three digits at most, no more than two after the point, never with an exponent."""
    if value is None:
        return ""
    digits = 2 - math.floor(math.log10(value)) if value > 0.0 else 0
    digits = min(digits, 3 if value < 0.1 else 2)
    return f"{round(value, digits):.{max(digits, 0)}f}"
