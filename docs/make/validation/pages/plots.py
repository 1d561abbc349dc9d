"""Pictures of the pages of the validation."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from mitsuba_diffraction.heights import GENTLE_SLOPE, STEEP_SLOPE

from ..cases import PROFILES, Case, Grating
from ..compare import Comparison, Sides, angles_of, gratings_of, table_of
from ..limits import GENTLE_ERROR, STEEP_ERROR
from ..models import of_colours
from ..statistics import CORRELATION, THETA, WAVELENGTH, Statistics, exact_lobe
from .markdown import percent

_SMALLEST = 1e-4  # deviations below it are drawn on it


def slopes_figure(gratings: Mapping[str, Sides]) -> Figure:
    """Deviation of the colours of sinusoids against RMS slope, at every angle, by material."""
    figure, axes = _figure(11.5, 4.8, len(gratings))
    for panel, (material, sides) in zip(axes, gratings.items(), strict=True):
        blend = sides["small_slope"]
        sinusoids = gratings_of(blend, "sinusoidal")
        slopes = np.array([grating.field.rms_slope for grating in sinusoids])
        angles = angles_of(blend.where(profile="sinusoidal"))
        for part, marker, fill, name in (
            (sides["kirchhoff"], "s", "none", "Kirchhoff"),
            (blend, "o", None, "default"),
        ):
            table = np.maximum(table_of(part, sinusoids, angles, of_colours), _SMALLEST)
            for column, (theta, colour) in enumerate(
                zip(angles, colormaps["viridis"](np.linspace(0, 0.9, len(angles))), strict=True)
            ):
                panel.loglog(
                    slopes, table[:, column], marker, ms=5, color=colour, mfc=fill,
                    label=f"{name}, {theta:g}°",
                )  # fmt: skip
        for slope, error in ((GENTLE_SLOPE, GENTLE_ERROR), (STEEP_SLOPE, STEEP_ERROR)):
            panel.axvline(slope, color="black", lw=0.8, ls=":")
            panel.axhline(error, color="black", lw=0.8, ls="--")
            panel.annotate(
                percent(error), (0.021, error), xytext=(0, 3), textcoords="offset points",
                fontsize=8,
            )  # fmt: skip
        panel.set(
            xlabel="RMS slope", title=material, xlim=(0.02, 1), ylim=(0.7 * _SMALLEST, 2),
            ylabel="deviation of colours, Σ |model − rigorous| / Σ rigorous",
        )  # fmt: skip
        panel.set_xticks(
            [0.02, 0.05, 0.1, 0.2, 0.5, 1], labels=["0.02", "0.05", "0.1", "0.2", "0.5", "1"]
        )
        panel.set_xticks([], minor=True)
        _frame(panel, title="model, incidence", loc="lower right")
    figure.suptitle(
        "Sinusoids beside the integral method. Dotted: where warnings begin; "
        f"deviations below {percent(_SMALLEST)} are drawn at it"
    )
    return figure


def orders_figure(comparison: Comparison, gratings: list[Grating], theta: float) -> Figure:
    """Efficiencies of the strongest orders against wavelength: both polarisations and the model."""
    figure, axes = _figure(4.6 * len(gratings), 4.4, len(gratings))
    for panel, grating in zip(axes, gratings, strict=True):
        part = comparison.where(grating=grating, theta=theta)
        numbers = part.order[:, 0]
        lights = _of_orders(part, lambda case: case.light.wavelength)
        strongest = sorted(
            set(numbers.tolist()), key=lambda m: -float(part.rigorous[numbers == m].max())
        )
        if theta == 0.0 and grating.profile != "blazed":  # ±m are equal
            strongest = [m for m in strongest if m >= 0]
        for n, order in enumerate(sorted(strongest[:3])):
            of_order = numbers == order
            wavelength, colour = lights[of_order], f"C{n}"
            for column, style in zip(part.exact[of_order].T, ("--", ":"), strict=True):
                panel.plot(wavelength, column, style, color=colour, lw=1)
            mean, model = part.rigorous[of_order], part.model[of_order]
            panel.plot(wavelength, mean, "-", color=colour, label=f"m = {order}")
            panel.plot(wavelength, model, "o", color=colour, ms=5, mfc="none")
        panel.set(
            xlabel="wavelength (nm)", ylabel="efficiency", ylim=(0, None),
            title=_title(grating),
        )  # fmt: skip
        panel.title.set_fontsize(10)
        _frame(panel)
    figure.suptitle(
        f"Perfect conductor, incidence {theta:g}°: rigorous TE (dashed), TM (dotted), "
        "mean (solid); model (circles)"
    )
    return figure


def scatter_figure(comparisons: dict[str, Comparison]) -> Figure:
    """Every order's efficiency by the model against the rigorous one, by material and profile."""
    figure, axes = _figure(4.4 * len(comparisons), 4.6, len(comparisons))
    for panel, (material, comparison) in zip(axes, comparisons.items(), strict=True):
        counted = comparison.counted
        ratio = _of_orders(comparison, lambda case: case.surface.depth / case.surface.period)
        theta = _of_orders(comparison, lambda case: case.light.theta)
        gentle = (ratio <= _GENTLE_RATIO) & (np.abs(theta) <= 30)
        profile = _of_orders(comparison, lambda case: case.surface.profile)
        # edges first: sinusoids would lie beneath them
        for n, name in reversed(list(enumerate(PROFILES))):
            for keep, marker, alpha in ((~gentle, ".", 0.15), (gentle, "o", 0.7)):
                chosen = counted & (profile == name) & keep
                label = name if marker == "o" else None
                panel.loglog(
                    comparison.rigorous[chosen], comparison.model[chosen], marker, color=f"C{n}",
                    ms=2.5, alpha=alpha, mew=0, label=label,
                )  # fmt: skip
        low, high = 1e-6, 1.5
        panel.plot([low, high], [low, high], color="black", lw=0.8)
        panel.set(
            xlim=(low, high), ylim=(low, high), title=_MODEL_OF[material],
            xlabel="rigorous efficiency", ylabel="model",
        )  # fmt: skip
        panel.set_aspect("equal")
        _frame(panel, markerscale=2, loc="upper left")
    figure.suptitle(
        f"Every order, unpolarised; strong colours: depth/period up to "
        f"{_GENTLE_RATIO:g}, incidence up to 30°"
    )
    return figure


def statistics_figure(statistics: Statistics) -> Figure:
    """Specular loss, scattered lobes and the mean of patches, with error bars."""
    figure, axes = _figure(14.0, 4.4, 3)
    _specular(axes[0], statistics)
    _lobes(axes[1], statistics)
    _offsets(axes[2], statistics)
    return figure


def _specular(axes: Axes, statistics: Statistics) -> None:
    x = np.linspace(0, 2.6, 200)
    axes.semilogy(x, np.exp(-(x**2)), color="black", lw=1, label="exp(−(κ·rms)²)")
    points = statistics.specular
    axes.errorbar(
        points.places, points.mean, 2 * points.error, fmt="o", ms=4,
        label=f"{points.count} surfaces, ± 2 standard errors",
    )  # fmt: skip
    axes.semilogy(points.places, points.exact, "_", ms=14, color="C3", label="with scattering")
    axes.set(xlabel="κ·rms", ylabel="mean power of order 0, |a₀|²", title="specular loss")
    _frame(axes)


def _lobes(axes: Axes, statistics: Statistics) -> None:
    for n, (rms, lobe) in enumerate(statistics.lobes.items()):
        fine = np.linspace(lobe.places.min(), lobe.places.max(), 400)
        axes.semilogy(fine, exact_lobe(rms, fine), color=f"C{n}", lw=1)
        axes.errorbar(
            lobe.places, lobe.mean, 2 * lobe.error, fmt="o", ms=3, color=f"C{n}",
            label=f"rms {lobe.name}",
        )  # fmt: skip
    axes.set(
        xlabel="exit angle (°)", ylabel="BRDF (1/sr)", ylim=(1e-4, None),
        title=f"incidence {THETA:g}°, {WAVELENGTH:g} nm, T = {CORRELATION:g} µm",
    )  # fmt: skip
    _frame(axes)


def _offsets(axes: Axes, statistics: Statistics) -> None:
    offsets = statistics.offsets
    ratio = offsets.mean / offsets.exact
    axes.axhline(1, color="black", lw=1)
    axes.errorbar(offsets.places, ratio, 2 * offsets.error / offsets.exact, fmt="o", ms=4)
    axes.set(
        xlabel="exit angle (°)", ylabel="mean of patches / ensemble, ± 2 standard errors",
        title=f"windows at {offsets.count} random places",
    )  # fmt: skip
    axes.grid(alpha=0.2)


#: A perfect conductor has no index, and Kirchhoff's model.
_MODEL_OF = {
    "perfect": "perfect conductor, Kirchhoff",
    "keratin": "keratin, default model",
    "aluminium": "aluminium, default model",
}

_GENTLE_RATIO = 0.05  # depth/period; of a sinusoid, an RMS slope of 0.11


def _of_orders(comparison: Comparison, value: Callable[[Case], Any]) -> NDArray[Any]:
    """A value of the case of each order."""
    solved = comparison.solved
    return np.repeat([value(s.case) for s in solved], [len(s.order) for s in solved])


def _title(grating: Grating) -> str:
    edges = grating.profile != "sinusoidal"  # with a slope beyond what pixels can tell
    return str(grating) if edges else f"{grating}, RMS slope {grating.field.rms_slope:.2f}"


def _frame(axes: Axes, **legend: Any) -> None:
    axes.grid(alpha=0.2)
    axes.legend(fontsize=8, **legend)


def _figure(width: float, height: float, panels: int) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, list(figure.subplots(1, panels, squeeze=False)[0])
