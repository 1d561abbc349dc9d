"""Draw docs/images/geometry.png: angles, orders, axes, grooves and window of docs/concepts.md.

python -m docs.make.figures.geometry -o docs/images/geometry.png
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Arc, Circle

from .pages import option, program, write_figure

#: Light of the drawing: angle from the normal, degrees; wavelength over period.
THETA, RATIO = 35.0, 0.34
_INK, _LIGHT, _ORDER, _PATCH = "#202020", "#d08000", "#0060b0", "#b0b8c0"


def figure() -> Figure:
    """Draw the plane of incidence and the surface seen from above."""
    drawing = Figure(figsize=(9.6, 4.3), dpi=110, layout="constrained")
    side, above = drawing.subplots(1, 2, width_ratios=(1.15, 1.0))
    _side(side)
    _above(above)
    for axes in (side, above):
        axes.set_aspect("equal")
        axes.set_axis_off()
    return drawing


def _side(axes: Axes) -> None:
    axes.set_title("Plane of incidence, φ = 0°", fontsize=10)
    x = np.linspace(-1.15, 1.15, 800)
    heights = 0.03 * np.cos(2.0 * np.pi * x / 0.23)
    axes.fill_between(x, heights, -0.16, color=_PATCH, lw=0)
    axes.plot(x, heights, color=_INK, lw=0.8)
    axes.annotate("", (0.0, 1.12), (0.0, 0.04), arrowprops={"arrowstyle": "-", "ls": ":"})
    axes.text(0.03, 1.08, "normal, z", fontsize=8)
    axes.annotate("", (1.2, -0.24), (0.55, -0.24), arrowprops={"arrowstyle": "->"})
    axes.text(1.2, -0.33, "x of the patch", ha="right", fontsize=8)
    axes.annotate("", (-0.465, -0.24), (-0.235, -0.24), arrowprops={"arrowstyle": "<->"})
    axes.text(-0.35, -0.33, "period d", ha="center", fontsize=8)
    sine = np.sin(np.radians(THETA))
    start = np.array([sine, np.cos(np.radians(THETA))])
    axes.annotate(
        "", 0.06 * start, start,
        arrowprops={"arrowstyle": "-|>", "color": _LIGHT, "lw": 2.0},
    )  # fmt: skip
    axes.text(*(1.05 * start), "light, ωi", color=_LIGHT, fontsize=9)
    axes.add_patch(Arc((0, 0), 0.8, 0.8, theta1=90.0 - THETA, theta2=90.0, color=_LIGHT))
    axes.text(0.13, 0.43, "θ", color=_LIGHT, fontsize=10)
    for order in (-1, 0, 1):
        # the light leaves with x = mλ/d − sinθ
        leaves = order * RATIO - sine
        if abs(leaves) >= 1.0:
            continue
        end = np.array([leaves, np.sqrt(1.0 - leaves**2)])
        width = 2.0 if order == 0 else 1.2
        axes.annotate(
            "", end, 0.06 * end,
            arrowprops={"arrowstyle": "-|>", "color": _ORDER, "lw": width},
        )  # fmt: skip
        angle = np.degrees(np.arcsin(-leaves))
        name = "mirror, m = 0" if order == 0 else f"m = {order}".replace("-", "−")
        text = f"{name}\ndetector {angle:+.0f}°".replace("-", "−")
        axes.text(
            *((1.18 if order == 1 else 1.07) * end), text, color=_ORDER, fontsize=8,
            ha="right" if leaves < 0.0 else "left", va="bottom",
        )  # fmt: skip
    axes.set_xlim(-1.75, 1.45)
    axes.set_ylim(-0.4, 1.3)


def _above(axes: Axes) -> None:
    axes.set_title("Surface from above", fontsize=10)
    for x in np.arange(-0.9, 0.91, 0.12):
        axes.plot((x, x), (-0.9, 0.9), color=_PATCH, lw=3.0, solid_capstyle="butt")
    axes.text(0.86, -1.0, "grooves along y: colours spread along x", ha="right", fontsize=8)
    for scale, alpha in ((0.45, 0.16), (0.3, 0.18), (0.15, 0.2)):
        axes.add_patch(Circle((0, 0), scale, color=_ORDER, alpha=alpha, lw=0))
    axes.annotate(
        "", (-0.45, -0.62), (0.45, -0.62),
        arrowprops={"arrowstyle": "<->", "color": _ORDER},
    )  # fmt: skip
    axes.text(
        0.0, -0.64, "coherence_width, 4σ", color=_ORDER, fontsize=8, ha="center", va="top",
        bbox={"color": "white", "alpha": 0.8, "pad": 1.0},
    )  # fmt: skip
    for end, name in (((1.25, 0.0), "x = ∂p/∂u"), ((0.0, 1.15), "y")):
        axes.annotate("", end, (0, 0), arrowprops={"arrowstyle": "->", "color": _INK, "lw": 1.4})
        axes.text(end[0] + 0.03, end[1] + 0.03, name, fontsize=9)
    phi = np.radians(40.0)
    place = 1.05 * np.array([np.cos(phi), np.sin(phi)])
    axes.annotate(
        "", 0.1 * place, place,
        arrowprops={"arrowstyle": "-|>", "color": _LIGHT, "lw": 2.0},
    )  # fmt: skip
    axes.text(*(1.03 * place), "light", color=_LIGHT, fontsize=9)
    axes.add_patch(Arc((0, 0), 1.2, 1.2, theta1=0.0, theta2=40.0, color=_LIGHT))
    axes.text(0.62, 0.16, "φ", color=_LIGHT, fontsize=10)
    axes.set_xlim(-1.05, 1.7)
    axes.set_ylim(-1.1, 1.3)


@program(option("-o", "--output", metavar="PNG", type=Path, required=True))
def main(args: argparse.Namespace) -> None:
    """Draw the picture."""
    write_figure(args.output, figure())
