"""The table of docs/methods.md, from a measured run.

    python -m docs.make.figures.methods \\
        --measured elaphe.png --pixel-size 0.0488 --max-height 0.375

What is written goes between the markers `methods` of the file.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mitsuba_diffraction.analysis.maps.result import Light
from mitsuba_diffraction.errors import DiffractionWarning
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.gratings import blazed, elaphe_like
from mitsuba_diffraction.thesis.methods import NAMES, OrdersOnly, make, make_all
from mitsuba_diffraction.thesis.methods.make import method_map
from mitsuba_diffraction.thesis.sweeps import Compiled, Step, compared, time_compiled, timed_map

from . import pages
from .pages import SHOWN, add_measured, exit_code, measured_patch

#: What each method leaves out.
APPROXIMATES = {
    "default": "only its tolerance: short series in κ, summed 5 nm apart",
    "flss": "the spectrum by samples 5 nm apart; Taylor series, which shallow surfaces allow",
    "nmm": "the spectrum by the wavelengths that one period sends to the eye, all of one weight; "
    "white around the mirror direction",
    "nmm, lobes": "the same, each wavelength weighted with its lobe's width",
    "pq": "the window by whole copies of the patch; linear between their orders",
    "pq-sinc": "the window by whole copies of the patch; sinc between their orders",
    "rainbow": "everything but the spacing: all orders equally bright",
}

_LIGHT = Light(30.0)
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
    made = dict(make_all(NAMES, patch, coherence="patch", step=step, coherence_width=width))
    fine = make("flss", patch, step=_FINE, coherence_width=width)
    plain = made["nmm"]
    assert isinstance(plain, OrdersOnly)
    made["nmm, lobes"] = OrdersOnly(plain.full, plain.periods, weights="lobe")
    reference = method_map(fine, _LIGHT, step=_FINE, resolution=resolution, samples=samples)
    result = {}
    for name, method in made.items():
        found, seconds = timed_map(
            method, _LIGHT, step=step, resolution=resolution, samples=samples
        )
        result[name] = compared(name, name, reference, found, seconds)
    return result


def table(measured: Measured) -> str:
    """The table in Markdown, and how it was measured."""
    rows = []
    for name, text in APPROXIMATES.items():
        grating, scale = measured.grating[name], measured.scale[name]
        cost = scale.seconds / measured.scale["flss"].seconds
        rows.append(
            (f"`{SHOWN.get(name, name)}`" if name in NAMES else name, text, f"{cost:.2g}",
             f"{grating.mean:.2g} (× {grating.blueness:.2f})", f"{scale.mean:.2g}")
        )  # fmt: skip
    header = (
        "method", "what it approximates", "time (`flss` = 1)", "ΔE on a blazed grating (blue/red)",
        "ΔE on a snake's scale",
    )  # fmt: skip
    compiled = measured.compiled
    note = (
        f"One BRDF map, light at 30°, one window, against `flss` at {_FINE:g} nm: mean ΔE2000 of "
        "the lit pixels.\nTimes are those of the NumPy evaluators. Compiled, with the whole "
        "spectrum at 5 nm, `spectral` (ensemble) takes\n"
        f"1/{compiled.ratio:.0f} of the time of `flss`, and as the RGB variants do it, without a "
        f"wavelength loop, 1/{compiled.colour_ratio:.0f}."
    )
    return f"{pages.table(header, rows)}\n\n{note}"


def main(argv: Sequence[str] | None = None) -> int:
    """Measure, and write the table into a page."""
    from mitsuba_diffraction.scene.load import set_variant

    parser = argparse.ArgumentParser(prog="python -m docs.make.figures.methods")
    parser.add_argument("-o", "--output", type=Path, default=Path("docs/methods.md"))
    add_measured(parser, "scale to measure; default: elaphe_like")
    parser.add_argument("--resolution", type=int, default=128)
    parser.add_argument("--small", action="store_true", help="small patches: a check")
    args = parser.parse_args(argv)

    def work() -> None:
        set_variant(None)
        scale = measured_patch(args)
        if scale is None:
            scale = elaphe_like(8.0, 128) if args.small else elaphe_like()
        with warnings.catch_warnings():
            # how far the model holds is not the question here
            warnings.simplefilter("ignore", DiffractionWarning)
            grating = blazed(2.5, 0.25, pixels_per_period=60, rows=16 if args.small else 64)
            measured = measure(
                grating, scale, resolution=args.resolution,
                coherence_width=8.0 if args.small else 65.0,
            )  # fmt: skip
        text = table(measured)
        pages.update(args.output, {"methods": text})

    return exit_code("methods", work)


if __name__ == "__main__":
    sys.exit(main())
