"""Parts of docs/validation/conductor.md: gratings of a perfect conductor."""

from __future__ import annotations

from functools import partial

from ..cases import PROBE_GRATING, Grating
from ..compare import Comparison, angles_of, table_of
from .markdown import angle, percent, table
from .measurements import Measurements


def parts(measured: Measurements) -> dict[str, str]:
    """Return the parts of the page by name."""
    grating = Grating(*PROBE_GRATING)
    part = measured.perfect.where(grating=grating)
    straight = {
        each.solved[0].case.light.wavelength: each.largest_relative()
        for each in part.where(theta=0.0).each()
    }
    to_550 = max(error for lam, error in straight.items() if lam <= 550)
    from_450 = max(error for lam, error in straight.items() if lam >= 450)
    rows = []
    for theta in angles_of(part):
        at = part.where(theta=theta)
        values = (at.largest_relative(), at.deviation(), at.deviation(colours=True), at.gain() - 1)
        rows.append([angle(theta), *map(percent, values)])
    header = [
        "incidence", "largest relative, orders −2 to 2", "deviation", "of colours", "light gained",
    ]  # fmt: skip
    return {
        "grating": f"{grating.period:g} µm, depth {grating.depth:g} µm, RMS slope "
        f"{grating.field.rms_slope:.3f}",
        "error": f"{percent(to_550)} up to 550 nm, and {percent(from_450)} from 450 to "
        f"{max(straight):g} nm",
        "a-gentle-sinusoid": table(header, rows),
        "polarised-light": _polarised(measured.perfect.where(profile="sinusoidal")),
    }


def _polarised(sinusoids: Comparison) -> str:
    angles = angles_of(sinusoids)
    rows = []
    for period, depth in ((5.0, 0.1), PROBE_GRATING[1:], (1.6, 0.2), (1.1, 0.4)):
        grating = Grating("sinusoidal", period, depth)
        for light in ("te", "tm"):
            measure = partial(Comparison.deviation, light=light)
            values = table_of(sinusoids, [grating], angles, measure)[0]
            rows.append([str(grating), light.upper(), *map(percent, values)])
    return table(["grating", "light", *map(angle, angles)], rows)
