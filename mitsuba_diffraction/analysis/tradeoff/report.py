"""Report of measured settings: text, plain data, CSV, plots, and the recommended setting."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...errors import DiffractionError
from ...images import save_figure
from .accuracy import Depths, Spectral
from .measuring import MeasuredSetting

_ALIKE = 1.1  # factor between equal times: they differ as much from run to run

_HEAD = "  error  plugin's  ΔE2000    99 %  × roughconductor   taps  terms      MB   s"
_MARKS = "osD^vP*Xp<>h"


@dataclass(frozen=True)
class Budget:
    """Limits of error, memory and time; None means unlimited."""

    tolerance: float | None = None  # largest error
    megabytes: float | None = None  # largest table
    relative: float | None = None  # longest time of `eval` over that of `roughconductor`

    def allows(self, result: MeasuredSetting) -> bool:
        """Return whether a setting stays within the limits."""
        limits = (
            (result.error, self.tolerance),
            (result.megabytes, self.megabytes),
            (result.relative, self.relative),
        )
        return all(limit is None or value <= limit for value, limit in limits)


def recommended(results: Sequence[MeasuredSetting], budget: Budget) -> MeasuredSetting:
    """Return the fastest setting within the tolerance, or without a tolerance the most exact one.

    Of equally fast settings the one with the smallest table. Only settings of coherence `ensemble`
    are candidates.

    Raises a DiffractionError if no measured setting stays within the budget.
    """
    candidates = [
        result
        for result in results
        if not result.refused
        and result.setting.group != "coherence"
        and math.isfinite(result.error)
    ]
    within = [result for result in candidates if budget.allows(result)]
    if not within:
        smallest = min(result.megabytes for result in candidates)
        fastest = min(result.relative for result in candidates)
        finest = min(result.error for result in candidates)
        raise DiffractionError(
            f"no setting stays within this budget: errors reach down to {finest:.1e}, tables to "
            f"{smallest:.1f} MB and eval to {fastest:.1f} times roughconductor, but not all at "
            "once; allow more of one"
        )
    if budget.tolerance is None:
        return min(within, key=lambda result: result.error)
    fastest = min(result.relative for result in within)
    as_fast = [result for result in within if result.relative <= _ALIKE * fastest]
    return min(as_fast, key=lambda result: result.megabytes)


def plain(results: list[MeasuredSetting], depths: Depths) -> dict[str, Any]:
    """Return all settings and the errors over depth as plain data."""
    return {
        "settings": [
            {"group": result.setting.group, "setting": result.setting.name,
             "arguments": result.setting.arguments,
             **{name: value for name, value in vars(result).items() if name != "setting"}}
            for result in results
        ],
        "depths": {
            "depth_um": depths.depth.tolist(),
            "errors": {name: values.tolist() for name, values in depths.errors.items()},
            "intervals": depths.intervals.tolist(),
        },
    }  # fmt: skip


def lines(
    results: Sequence[MeasuredSetting],
    spectral: Spectral,
    best: MeasuredSetting,
    budget: Budget,
) -> Iterator[str]:
    """Yield a row for each setting, the errors of sums over the spectrum, the recommendation."""
    width = max(len(result.setting.name) for result in results)
    yield f"{'':<{width}} {_HEAD}"
    for result in results:
        name = f"{result.setting.name:<{width}}"
        if result.refused:
            yield f"{name}  {result.refused}"
            continue
        series = f"{result.intervals} × {result.terms}"
        yield (
            f"{name} {result.error:7.1e}   {result.error_single:7.1e} {result.delta_e:7.3f} "
            f"{result.delta_e_99:7.2f} {result.relative:16.2f} {result.taps:6d} {series:>6} "
            f"{result.megabytes:7.2f} {result.seconds:3.1f}"
        )
    steps = ", ".join(f"{step:g} nm {error:.2f}" for step, error in spectral.steps.items())
    counts = ", ".join(f"{count} {noise:.2f}" for count, noise in spectral.counts.items())
    yield f"sums over the spectrum, ΔE2000: {steps}"
    yield f"wavelengths of a ray, noise of its luminance: {counts}"
    limits = ", ".join(f"{name} {value:g}" for name, value in vars(budget).items() if value)
    within = f" ({limits})" if limits else ""
    yield (
        f"recommended{within}: {best.setting.name}: error {best.error:.1e}, "
        f"{best.relative:.1f} × roughconductor, {best.megabytes:.1f} MB"
    )


def draw_trade(results: Sequence[MeasuredSetting], path: Path, title: str) -> None:
    """Draw error against time, with the memory as area of the marks, and the Pareto front."""
    drawn = [r for r in results if not r.refused and r.setting.group != "coherence"]
    axes = _axes(5.0)
    groups = list(dict.fromkeys(r.setting.group for r in drawn))
    for n, group in enumerate(groups):
        members = [r for r in drawn if r.setting.group == group]
        axes.scatter(
            [r.relative for r in members], [r.error for r in members],
            s=[12 + 6 * r.megabytes for r in members], marker=_MARKS[n % len(_MARKS)],
            color=f"C{n % 10}", alpha=0.75, label=group, edgecolors="black", linewidths=0.4,
            zorder=3,
        )  # fmt: skip
    front = _front(drawn)
    axes.step(
        [r.relative for r in front], [r.error for r in front], where="post", color="0.5",
        lw=1.0, label="no faster setting is as exact",
    )  # fmt: skip
    default = drawn[0]
    axes.annotate(
        "default", (default.relative, default.error), (12, 10), textcoords="offset points",
        fontsize=8, arrowprops={"arrowstyle": "-", "lw": 0.6},
    )  # fmt: skip
    axes.set(xlabel="time of eval (roughconductor, Al = 1)")
    axes.set(ylabel="relative error of the diffracted power")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    axes.set_title(f"{title}; area of a mark: memory", fontsize=9)
    legend = axes.legend(fontsize=7, ncols=2)
    for handle in legend.legend_handles:
        if handle is not None and hasattr(handle, "set_sizes"):
            handle.set_sizes([36.0])
    save_figure(path, axes.figure, dpi=130)


def draw_depths(depths: Depths, path: Path) -> None:
    """Draw the error of each series over depth."""
    axes = _axes(4.2)
    for n, (name, errors) in enumerate(depths.errors.items()):
        axes.plot(
            depths.depth, np.clip(errors, 1e-8, 10.0), marker=_MARKS[n], ms=4, lw=1.2, label=name
        )
    axes.axhline(1e-3, color="0.4", lw=0.8, ls="--", label="tolerance")
    axes.set(ylim=(1e-8, 20.0), xlabel="depth of the surface, peak to valley (µm)")
    axes.set(ylabel="relative error of the orders (cut at 10)")
    axes.set_title("light of 380 nm, normal; a line that ends is refused from there on", fontsize=9)
    axes.legend(fontsize=7)
    save_figure(path, axes.figure, dpi=130)


def _front(results: Sequence[MeasuredSetting]) -> list[MeasuredSetting]:
    """Return the Pareto front: settings that no other beats in time and error, fastest first."""
    front: list[MeasuredSetting] = []
    for result in sorted(results, key=lambda result: result.relative):
        if not front or result.error < front[-1].error:
            front.append(result)
    return front


def _axes(height: float) -> Any:
    """Return logarithmic axes in a new figure of this height in inches."""
    from matplotlib.figure import Figure  # slow to import, and not needed for text

    axes = Figure(figsize=(7.6, height), layout="constrained").add_subplot()
    axes.set(xscale="log", yscale="log")
    axes.grid(alpha=0.3)
    return axes
