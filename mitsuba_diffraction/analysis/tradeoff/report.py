"""What was measured of all settings, as text, plain data, CSV and plots; which one to take."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ...atomic import atomic_path
from ...errors import DiffractionError
from .accuracy import Depths, Spectral
from .measuring import Measured, rows

_ALIKE = 1.1  # times differ by as much from one run to the next

_HEAD = "  error  plugin's  ΔE2000    99 %  × roughconductor   taps  terms      MB   s"
_MARKS = "osD^vP*Xp<>h"


@dataclass(frozen=True)
class Budget:
    """What a user can afford; None: as much as it takes."""

    tolerance: float | None = None  # largest error
    megabytes: float | None = None  # of the table
    relative: float | None = None  # time of `eval` over that of `roughconductor`

    def allows(self, one: Measured) -> bool:
        """Whether a setting stays within it."""
        limits = (
            (one.error, self.tolerance),
            (one.megabytes, self.megabytes),
            (one.relative, self.relative),
        )
        return all(limit is None or value <= limit for value, limit in limits)


def recommended(results: Sequence[Measured], budget: Budget) -> Measured:
    """The fastest setting that is exact enough; without a tolerance, the most exact one.

    Of settings that are about as fast the smallest is taken.

    Only settings that compute the same thing (coherence `ensemble`) and that a user can ask for
    compete.

    Raises
    ------
    DiffractionError
        If nothing that was measured stays within the budget.
    """
    able = [
        one
        for one in results
        if not one.refused
        and one.setting.usable
        and one.setting.group != "coherence"
        and math.isfinite(one.error)
    ]
    within = [one for one in able if budget.allows(one)]
    if not within:
        smallest = min(one.megabytes for one in able)
        fastest = min(one.relative for one in able)
        finest = min(one.error for one in able)
        raise DiffractionError(
            f"no setting stays within this budget: errors reach down to {finest:.1e}, tables to "
            f"{smallest:.1f} MB and eval to {fastest:.1f} times roughconductor, but not all at "
            "once; allow more of one"
        )
    if budget.tolerance is None:
        return min(within, key=lambda one: one.error)
    fastest = min(one.relative for one in within)
    as_fast = [one for one in within if one.relative <= _ALIKE * fastest]
    return min(as_fast, key=lambda one: one.megabytes)


def plain(results: list[Measured], depths: Depths) -> dict[str, Any]:
    """All settings, and the errors over depth."""
    return {
        "settings": list(rows(results)),
        "depths": {
            "depth_um": depths.depth.tolist(),
            "errors": {name: values.tolist() for name, values in depths.errors.items()},
            "intervals": depths.intervals.tolist(),
        },
    }


def save_csv(path: Path, settings: Sequence[Mapping[str, Any]]) -> None:
    """Write the settings of `plain`, a row each."""
    with (
        atomic_path(path) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as file,
    ):
        columns = [name for name in settings[0] if name != "arguments"]
        writer = csv.DictWriter(file, columns, extrasaction="ignore")
        writer.writeheader()
        writer.writerows(settings)


def lines(
    results: Sequence[Measured],
    spectral: Spectral,
    best: Measured,
    budget: Mapping[str, float | None],
) -> Iterator[str]:
    """A row for each setting, the errors of sums over the spectrum, and the recommendation."""
    width = max(len(one.setting.name) for one in results)
    yield f"{'':<{width}} {_HEAD}"
    for one in results:
        name = f"{one.setting.name:<{width}}"
        if one.refused:
            yield f"{name}  {one.refused}"
            continue
        series = f"{one.intervals} × {one.terms}"
        yield (
            f"{name} {one.error:7.1e}   {one.error_single:7.1e} {one.delta_e:7.3f} "
            f"{one.delta_e_99:7.2f} {one.relative:16.2f} {one.taps:6d} {series:>6} "
            f"{one.megabytes:7.2f} {one.seconds:3.1f}"
        )
    steps = ", ".join(f"{step:g} nm {error:.2f}" for step, error in spectral.steps.items())
    counts = ", ".join(f"{count} {noise:.2f}" for count, noise in spectral.counts.items())
    yield f"sums over the spectrum, ΔE2000: {steps}"
    yield f"wavelengths of a ray, noise of its luminance: {counts}"
    asked = ", ".join(f"{name} {value:g}" for name, value in budget.items() if value)
    arguments = best.setting.arguments or {"": "the defaults"}
    said = ", ".join(f"{k}={v}" if k else str(v) for k, v in arguments.items())
    if best.setting.crop is not None:
        said += f", crop at {best.setting.crop:g} of all frequencies"
    yield (
        f"recommended{f' ({asked})' if asked else ''}: {said}: error {best.error:.1e}, "
        f"{best.relative:.1f} × roughconductor, {best.megabytes:.1f} MB"
    )


def draw_trade(results: Sequence[Measured], path: Path, title: str) -> None:
    """Error against time, the area of a mark for its memory, and the best of all at each error."""
    shown = [one for one in results if not one.refused and one.setting.group != "coherence"]
    axes = _axes(5.0)
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
    axes.set(xlabel="time of eval (roughconductor, Al = 1)")
    axes.set(ylabel="relative error of the diffracted power")
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("{x:g}")
    axes.set_title(f"{title}; area of a mark: memory", fontsize=9)
    legend = axes.legend(fontsize=7, ncols=2)
    for handle in legend.legend_handles:
        if handle is not None and hasattr(handle, "set_sizes"):
            handle.set_sizes([36.0])
    _save(axes, path)


def draw_depths(depths: Depths, path: Path) -> None:
    """Where Taylor's series breaks down, beside those that do not."""
    axes = _axes(4.2)
    for n, (name, errors) in enumerate(depths.errors.items()):
        axes.plot(
            depths.depth, np.clip(errors, 1e-8, 10.0), marker=_MARKS[n], ms=4, lw=1.2, label=name
        )
    axes.axhline(1e-3, color="0.4", lw=0.8, ls="--", label="the tolerance that is asked for")
    axes.set(ylim=(1e-8, 20.0), xlabel="depth of the surface, peak to valley (µm)")
    axes.set(ylabel="relative error of the orders (cut at 10)")
    axes.set_title("light of 380 nm, normal; a line that ends is refused from there on", fontsize=9)
    axes.legend(fontsize=7)
    _save(axes, path)


def _front(results: Sequence[Measured]) -> list[Measured]:
    """Settings that nothing is both faster and more exact than, fastest first."""
    front: list[Measured] = []
    for one in sorted(results, key=lambda one: one.relative):
        if not front or one.error < front[-1].error:
            front.append(one)
    return front


def _axes(height: float) -> Any:
    """Both logarithmic, in a figure of that height in inches."""
    from matplotlib.figure import Figure  # not for those who draw nothing

    axes = Figure(figsize=(7.6, height), layout="constrained").add_subplot()
    axes.set(xscale="log", yscale="log")
    axes.grid(alpha=0.3)
    return axes


def _save(axes: Any, path: Path) -> None:
    with atomic_path(path) as temporary:
        axes.figure.savefig(temporary, dpi=130, format="png")
