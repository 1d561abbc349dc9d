"""Pictures of the trade (Matplotlib)."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ...atomic import atomic_path
from .depth import Depths
from .measuring import Measured

_MARKS = "osD^vP*Xp<>h"


def draw_trade(results: Sequence[Measured], path: Path, title: str) -> None:
    """Error against time, the area of a mark for its memory, and the best of all at each error."""
    shown = [one for one in results if not one.refused and one.setting.group != "coherence"]
    figure = Figure(figsize=(7.6, 5.0), layout="constrained")
    axes = figure.add_subplot()
    groups = list(dict.fromkeys(one.setting.group for one in shown))
    for n, group in enumerate(groups):
        mine = [one for one in shown if one.setting.group == group]
        axes.scatter(
            [one.relative for one in mine], [one.error for one in mine],
            s=[12 + 6 * one.megabytes for one in mine], marker=_MARKS[n % len(_MARKS)],
            color=f"C{n % 10}", alpha=0.75, label=group, edgecolors="black", linewidths=0.4,
            zorder=3,
        )  # fmt: skip
    front = _front(shown)
    axes.step(
        [one.relative for one in front], [one.error for one in front], where="post", color="0.5",
        lw=1.0, label="nothing faster is as exact",
    )  # fmt: skip
    default = shown[0]
    axes.annotate(
        "default", (default.relative, default.error), (12, 10), textcoords="offset points",
        fontsize=8, arrowprops={"arrowstyle": "-", "lw": 0.6},
    )  # fmt: skip
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    axes.set_xlabel("time of eval (roughconductor, Al = 1)")
    axes.set_ylabel("relative error of the diffracted power")
    axes.set_title(f"{title}; area of a mark: memory", fontsize=9)
    axes.grid(alpha=0.3)
    legend = axes.legend(fontsize=7, ncols=2)
    for handle in legend.legend_handles:
        if handle is not None and hasattr(handle, "set_sizes"):
            handle.set_sizes([36.0])
    _save(figure, path)


def draw_depths(depths: Depths, path: Path) -> None:
    """Where Taylor's series breaks down, beside those that do not."""
    figure = Figure(figsize=(7.6, 4.2), layout="constrained")
    axes = figure.add_subplot()
    for n, (name, errors) in enumerate(depths.errors.items()):
        axes.plot(
            depths.depth, np.clip(errors, 1e-8, 10.0), marker=_MARKS[n], ms=4, lw=1.2, label=name
        )
    axes.axhline(1e-3, color="0.4", lw=0.8, ls="--", label="the tolerance that is asked for")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(1e-8, 20.0)
    axes.set_xlabel("depth of the surface, peak to valley (µm)")
    axes.set_ylabel("relative error of the orders (cut at 10)")
    axes.set_title("light of 380 nm, normal; a line that ends is refused from there on", fontsize=9)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=7)
    _save(figure, path)


def _front(results: Sequence[Measured]) -> list[Measured]:
    """Settings that nothing is both faster and more exact than, fastest first."""
    front: list[Measured] = []
    for one in sorted(results, key=lambda one: one.relative):
        if not front or one.error < front[-1].error:
            front.append(one)
    return front


def _save(figure: Figure, path: Path) -> None:
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=130, format="png")
