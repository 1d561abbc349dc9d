"""What `compare` found, as a Markdown table of the methods."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

_OURS = ("lut", "spectral")
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
            f"{_plain(document['noise_delta_e_mean'])}.",
        ]
    )


def scenes_table(documents: Sequence[dict[str, Any]]) -> str:
    """How far `lut` and `spectral` are off in some scenes, over all pixels that are compared.

    Parameters
    ----------
    documents : what is in each compare.json.
    """
    head = "| scene |" + "".join(f" `{m}`, ΔE2000 mean | 99 % |" for m in _OURS)
    rows = [head + " noise | pixels |", "|---|" + 2 * len(_OURS) * "---|" + "---|---|"]
    for document in documents:
        cells = [f"[{Path(document['scene']).stem}]({document['scene']})"]
        for method in _OURS:
            found = document["methods"][method]["both"]
            cells += [_plain(found["delta_e_mean"]), _plain(found["delta_e_percentiles"]["99"])]
        pixels = document["methods"][_OURS[0]]["both"]["pixels"]
        rows.append(
            f"| {' | '.join(cells)} | {_plain(document['noise_delta_e_mean'])} | {pixels} |"
        )
    return "\n".join(rows)


def _row(method: str, entry: dict[str, Any], slow: float | None) -> str:
    found = entry["diffracting"]
    cells = (
        f"`{method}`",
        _plain(found["delta_e_mean"]),
        _plain(found["delta_e_percentiles"].get("99")),
        _plain(found["flip"]),
        _plain(found["relative_rmse"]),
        _plain(entry["frame_ms"]),
        _plain(entry["fragment_ns"]),
        _plain(slow / entry["fragment_ns"] if slow else None),
        _plain(entry["look_up_ns"]),
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
