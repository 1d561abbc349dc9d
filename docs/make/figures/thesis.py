"""The methods of the thesis: tables and pictures of docs/thesis.md.

    python -m docs.make.figures.thesis methods \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375
    python -m docs.make.figures.thesis sweeps
    python -m docs.make.figures.thesis evaluation

Tables go between markers of the page: methods, the distance of each map of a sweep from the best,
and fitted periods. Pictures go to `images/sweep-KIND.png` and `images/evaluation.png` beside the
page.
"""

from __future__ import annotations

import argparse
import math
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.maps import LightDirection, contact_sheet
from mitsuba_diffraction.errors import DiffractionWarning
from mitsuba_diffraction.heights.gratings import blazed, elaphe_like
from mitsuba_diffraction.thesis.methods import NAMES, OrdersOnly, make, make_all, method_map
from mitsuba_diffraction.thesis.sweeps import (
    SWEEPS,
    Compiled,
    Step,
    Sweep,
    sweep,
    time_compiled,
    timed_map,
)

from . import pages
from .evaluation import write_evaluation
from .pages import measured_options, measured_patch, option, program

#: What each method leaves out.
APPROXIMATES = {
    "spectral": "only its tolerance: short series in κ, summed 5 nm apart",
    "flss": "the spectrum by samples 5 nm apart; Taylor series, for shallow surfaces",
    "nmm": "the spectrum by the wavelengths that one period sends to the eye, equally weighted",
    "nmm, lobes": "the same, each wavelength weighted with its lobe's width",
    "pq": "the window by whole copies of the patch; linear between their orders",
    "pq-sinc": "as `pq`, with sinc between the orders",
    "rainbow": "everything but the spacing: all orders equally bright",
}

_LIGHT = LightDirection(30.0)
_FINE = 1.0  # nm, of the reference


@dataclass(frozen=True)
class Measured:
    """A run on two patches: steps by method, and the compiled times on the second."""

    grating: Mapping[str, Step]
    scale: Mapping[str, Step]
    compiled: Compiled


def measure(
    grating: HeightField,
    scale: HeightField,
    *,
    resolution: int = 128,
    coherence_width: float = 65.0,
    step: float = 5.0,
) -> Measured:
    """All methods on a grating and on a snake's scale, light at 30°, against `flss` at 1 nm."""
    return Measured(
        _steps(grating, resolution, 4, step, coherence_width),
        _steps(scale, resolution, 1, step, coherence_width),
        time_compiled(
            scale, _LIGHT, resolution=2 * resolution, samples=1, step=step,
            coherence_width=coherence_width,
        ),
    )  # fmt: skip


def _steps(
    patch: HeightField, resolution: int, samples: int, step: float, width: float
) -> dict[str, Step]:
    by_name = dict(make_all(NAMES, patch, coherence="patch", step=step, coherence_width=width))
    fine = make("flss", patch, step=_FINE, coherence_width=width)
    plain = by_name["nmm"]
    assert isinstance(plain, OrdersOnly)
    by_name["nmm, lobes"] = OrdersOnly(plain.full, plain.periods, weights="lobe")
    reference = method_map(fine, _LIGHT, step=_FINE, resolution=resolution, samples=samples)
    result = {}
    for name, method in by_name.items():
        timed = timed_map(method, _LIGHT, step=step, resolution=resolution, samples=samples)
        result[name] = Step(name, name, *timed).compared(reference)
    return result


def table(measured: Measured) -> str:
    """The table in Markdown, and how it was measured."""
    rows = []
    for name, text in APPROXIMATES.items():
        grating, scale = measured.grating[name], measured.scale[name]
        cost = scale.seconds / measured.scale["flss"].seconds
        rows.append(
            (f"`{name}`" if name in NAMES else name, text, f"{cost:.2g}",
             f"{grating.difference.delta_e:.2g} (× {grating.difference.blueness:.2f})",
             f"{scale.difference.delta_e:.2g}")
        )  # fmt: skip
    header = (
        "method", "what it approximates", "time (`flss` = 1)", "ΔE on a blazed grating (blue/red)",
        "ΔE on a snake's scale",
    )  # fmt: skip
    compiled = measured.compiled
    note = (
        f"One BRDF map, light at 30°, one window, against `flss` at {_FINE:g} nm: mean ΔE2000 of "
        "the lit pixels.\nTimes are measured with the NumPy evaluators. Compiled, with the whole "
        "spectrum at 5 nm, `spectral` (ensemble) takes\n"
        f"1/{compiled.ratio:.0f} of the time of `flss`, and as the RGB variants do it, without a "
        f"wavelength loop, 1/{compiled.colour_ratio:.0f}."
    )
    return f"{pages.table(header, rows)}\n\n{note}"


def numbers(result: Sweep) -> str:
    """ΔE of every step, as a Markdown table."""
    rows: list[tuple[str, ...]] = []
    for step in result.steps:
        cell = ""
        if step.label == result.reference:
            cell = "reference"
        elif math.isfinite(step.difference.delta_e):
            cell = f"{step.difference.delta_e:.2g}"
        rows.append((step.label, cell))
    return pages.table(("value", "mean ΔE"), rows)


def write_methods(args: argparse.Namespace, scale: HeightField | None) -> None:
    """Measure, and write the table."""
    from mitsuba_diffraction.scene import set_variant

    set_variant(None)
    scale = scale or (elaphe_like(8.0, 128) if args.small else elaphe_like())
    grating = blazed(2.5, 0.25, pixels_per_period=60, rows=16 if args.small else 64)
    measured = measure(
        grating, scale, resolution=args.resolution or 128,
        coherence_width=8.0 if args.small else 65.0,
    )  # fmt: skip
    pages.update(args.output or Path("docs/thesis.md"), {"methods": table(measured)})


def write_sweeps(args: argparse.Namespace, patch: HeightField | None) -> None:
    """Make all sheets and tables."""
    page = args.output or Path("docs/thesis.md")
    small = blazed(2.0, 0.2, periods=6, rows=8)
    patch = patch or (small if args.small else elaphe_like())
    parts = {}
    shown = pages.markers(page)
    for kind in args.only or [kind for kind in SWEEPS if kind in shown]:
        print(f"sweeping {kind}", flush=True)
        result = sweep(kind, patch, _LIGHT, resolution=args.resolution or 160)
        parts[kind] = numbers(result)
        best = next((s for s in result.steps if s.label == result.reference), None)
        sheet = contact_sheet(
            [step.map for step in result.steps],
            [step.label for step in result.steps],
            title=f"{patch.name}: {kind}",
            exposure=None if best is None else best.map.exposure(),
        )
        pages.write_figure(page.parent / "images" / f"sweep-{kind}.png", sheet)
    pages.update(page, parts)


PROGRAMS = {"methods": write_methods, "sweeps": write_sweeps, "evaluation": write_evaluation}


@program(
    option("page", choices=tuple(PROGRAMS)),
    option("-o", "--output", type=Path, help="default: that page in docs"),
    *measured_options("scale to take; default: elaphe_like, and further ones of the evaluation"),
    option("--only", metavar="KIND", action="append", choices=tuple(SWEEPS)),
    option("--resolution", type=int, help="of maps; default: 128, of sweeps 160"),
    option("--windows", type=int, default=64, help="single windows of the evaluation"),
    option("--angle-step", type=float, default=0.05, help="of the evaluation, degrees"),
    option("--small", action="store_true", help="small patches: a check"),
)
def main(args: argparse.Namespace) -> None:
    """Write one of the pages."""
    patch = measured_patch(args)
    with warnings.catch_warnings():
        # how far the model holds is not the question here
        warnings.simplefilter("ignore", DiffractionWarning)
        PROGRAMS[args.page](args, patch)
