"""The methods of the thesis: tables and pictures of docs/thesis.md.

    python -m docs.make.figures.thesis methods \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375
    python -m docs.make.figures.thesis evaluation

Tables of methods and fitted periods go between markers of the page, and a picture to
`images/evaluation.png` beside it.
"""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Mapping
from pathlib import Path

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.maps import LightDirection
from mitsuba_diffraction.errors import DiffractionWarning
from mitsuba_diffraction.heights.gratings import blazed, elaphe_like
from mitsuba_diffraction.thesis.methods import NAMES, OrdersOnly, make, make_all, method_map
from mitsuba_diffraction.thesis.sweeps import Compiled, Step, time_compiled, timed_map

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


def _steps(
    patch: HeightField, resolution: int, samples: int, step: float, width: float
) -> dict[str, Step]:
    """Evaluate all methods on a patch against `flss` at 1 nm."""
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


def table(on_grating: Mapping[str, Step], on_scale: Mapping[str, Step], compiled: Compiled) -> str:
    """Return the table of steps on two patches by method, and how it was measured."""
    rows = []
    for name, text in APPROXIMATES.items():
        grating, scale = on_grating[name], on_scale[name]
        cost = scale.seconds / on_scale["flss"].seconds
        rows.append(
            (f"`{name}`" if name in NAMES else name, text, f"{cost:.2g}",
             f"{grating.difference.delta_e:.2g} (× {grating.difference.blueness:.2f})",
             f"{scale.difference.delta_e:.2g}")
        )  # fmt: skip
    header = (
        "method", "what it approximates", "time (`flss` = 1)", "ΔE on a blazed grating (blue/red)",
        "ΔE on a snake's scale",
    )  # fmt: skip
    note = (
        f"One BRDF map, light at 30°, one window, against `flss` at {_FINE:g} nm: mean ΔE2000 of "
        "the lit pixels.\nTimes are measured with the NumPy evaluators. Compiled, with the whole "
        "spectrum at 5 nm, `spectral` (ensemble) takes\n"
        f"1/{compiled.ratio:.0f} of the time of `flss`, and as the RGB variants do it, without a "
        f"wavelength loop, 1/{compiled.colour_ratio:.0f}."
    )
    return f"{pages.table(header, rows)}\n\n{note}"


def write_methods(args: argparse.Namespace, scale: HeightField | None) -> None:
    """Measure, and write the table."""
    from mitsuba_diffraction.scene import set_variant

    set_variant(None)
    scale = scale or (elaphe_like(8.0, 128) if args.small else elaphe_like())
    grating = blazed(2.5, 0.25, pixels_per_period=60, rows=16 if args.small else 64)
    resolution, width, step = args.resolution, 8.0 if args.small else 65.0, 5.0
    compiled = time_compiled(
        scale, _LIGHT, resolution=2 * resolution, samples=1, step=step, coherence_width=width
    )
    on_grating = _steps(grating, resolution, 4, step, width)
    text = table(on_grating, _steps(scale, resolution, 1, step, width), compiled)
    pages.update(args.output or Path("docs/thesis.md"), {"methods": text})


PROGRAMS = {"methods": write_methods, "evaluation": write_evaluation}


@program(
    option("page", choices=tuple(PROGRAMS)),
    option("-o", "--output", type=Path, help="default: that page in docs"),
    *measured_options("scale to take; default: elaphe_like, and further ones of the evaluation"),
    option("--resolution", type=int, default=128, help="of maps; 128"),
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
