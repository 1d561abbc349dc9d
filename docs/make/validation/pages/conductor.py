"""docs/validation/conductor.md: gratings of a perfect conductor."""

from __future__ import annotations

from ..cases import PROBE_GRATING, Grating
from ..compare import Comparison, angles_of, table_of
from .markdown import angle, percent, table
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
    return f"""# Gratings of a perfect conductor

`material="none"` uses Kirchhoff's model without polarisation.

{_probe(measured)}

{_polarisation(measured)}"""


def _probe(measured: Measurements) -> str:
    grating = Grating(*PROBE_GRATING)
    part = measured.perfect.where(grating=grating)
    straight = part.where(theta=0.0)
    wavelengths = sorted({solved.case.light.wavelength for solved in straight.solved})
    to_550 = max(_relative(straight, w) for w in wavelengths if w <= 550)
    from_450 = max(_relative(straight, w) for w in wavelengths if w >= 450)
    rows = []
    for theta in angles_of(part):
        at = part.where(theta=theta)
        values = (at.largest_relative(), at.deviation(), at.deviation(colours=True), at.gain() - 1)
        rows.append([angle(theta), *map(percent, values)])
    header = [
        "incidence", "largest relative, orders −2 to 2", "deviation", "of colours", "light gained",
    ]  # fmt: skip
    return f"""## A gentle sinusoid

Period {grating.period:g} µm, depth {grating.depth:g} µm, RMS slope {grating.field.rms_slope:.3f},
unpolarised light. At normal incidence the relative error of the orders −2 to 2 is at most
{percent(to_550)} up to 550 nm, and {percent(from_450)} from 450 to {wavelengths[-1]:g} nm.

{table(header, rows)}

![Efficiencies of three gratings against wavelength](../images/validation_orders.png)"""


def _relative(part: Comparison, wavelength: float) -> float:
    return part.where(wavelength=wavelength).largest_relative()


def _polarisation(measured: Measurements) -> str:
    sinusoids = measured.perfect.where(profile="sinusoidal")
    angles = angles_of(sinusoids)
    rows = []
    for period, depth in ((5.0, 0.1), PROBE_GRATING[1:], (1.6, 0.2), (1.1, 0.4)):
        grating = Grating("sinusoidal", period, depth)
        for light in ("te", "tm"):
            values = table_of(
                sinusoids, [grating], angles, lambda part, light=light: part.deviation(light=light)
            )[0]
            rows.append([str(grating), light.upper(), *map(percent, values)])
    return f"""## Polarised light

Deviation of all orders of the unpolarised model from each polarisation:

{table(["grating", "light", *map(angle, angles)], rows)}"""
