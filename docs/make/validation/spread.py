"""Where light goes that the model spreads: a blazed interface, beside Rayleigh's expansion.

Its flanks are gentle enough for that: three harmonics of a sawtooth, smoothed after Lanczos.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionTable, HeightField, reference
from mitsuba_diffraction.optics import boundary
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, wavenumber
from mitsuba_diffraction.tables.energy.conservation import DirectionalTable
from mitsuba_diffraction.tables.energy.links import Medium
from mitsuba_diffraction.tables.energy.sides import Sides

from . import rayleigh
from .pages.markdown import percent, table

Real = NDArray[np.float64]

PERIOD, DEPTH, INDEX, WAVELENGTH = 4.0, 0.25, 1.5, 550.0
ANGLES, AZIMUTHS = (45.0, 60.0, 75.0), (0.0, 180.0)
#: So many orders have nearly all light, of which there are 30.
STRONGEST = 5
_PIXELS, _HARMONICS = 64, 25


@dataclass(frozen=True)
class Shares:
    """Of all light, reflected and then transmitted orders (n,); and what is spread.

    Attributes
    ----------
    exact, plain, scaled : rigorously, by the model as it is, and with its orders scaled.
    """

    exact: Real
    plain: Real
    scaled: Real
    spread: float

    def off(self, modelled: Real) -> float:
        """Σ|η − η_rigorous| of the orders."""
        return float(np.abs(modelled - self.exact).sum())

    def in_strongest(self) -> float:
        """Of what is missing in scaled orders, how much rigorously is in the strongest ones."""
        missing = np.maximum(self.exact - self.scaled, 0.0)
        strongest = np.argsort(self.exact)[-STRONGEST:]
        return float(missing[strongest].sum() / missing.sum())


def surface() -> HeightField:
    """One period, whose steep flank has a slope of 0.34 and whose gentle one of 0.1."""
    phase = np.arange(_PIXELS) * (2.0 * np.pi / _PIXELS)
    heights = sum(np.sinc(n / 4) / n * np.sin(n * phase) for n in (1, 2, 3))
    return HeightField(np.tile(heights * (DEPTH / np.ptp(heights)), (2, 1)), PERIOD / _PIXELS)


@lru_cache
def _scale() -> tuple[Sides, list[DirectionalTable], float]:
    built = DiffractionTable.build(surface(), height_scale_max=INDEX)
    sides = Sides(built, 1.0, Medium(INDEX, "small_slope", thin=False))
    return sides, sides.scale((WAVELENGTH, WAVELENGTH)) or [], built.sigma


def shares(theta: float, azimuth: float) -> Shares:
    """Of light from above along angles in degrees."""
    sides, scale, sigma = _scale()
    field, ends = surface(), np.radians([theta, azimuth])
    polar, turn = ends
    wi = np.array([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    per_f = np.pi / (sigma * float(wavenumber(WAVELENGTH))) ** 2
    found = []
    for side, solve in enumerate((rayleigh.solve, rayleigh.through)):
        orders = solve(field, INDEX, WAVELENGTH, wi, _HARMONICS)
        cosines = np.abs(orders.wo[:, 2])
        exact = boundary.unpolarised(orders.jones) * (INDEX if side else 1.0) * cosines / wi[2]
        model = reference.btdf if side else reference.brdf
        plain = per_f * model(
            field, wi, orders.wo, WAVELENGTH, eta=INDEX, model="small_slope",
            coherence_width=WIDTHS_PER_SIGMA * sigma,
            **({} if side else {"second_order": False}),
        )  # fmt: skip
        left = np.arccos(cosines), np.arctan2(orders.wo[:, 1], orders.wo[:, 0])
        c, s = (
            sides.at(scale[n], 0, *ends, WAVELENGTH)
            * sides.at(scale[n + side], side, *left, WAVELENGTH)
            for n in (0, 2)
        )
        zeroth = (orders.order == 0).all(axis=1)
        found.append((exact, plain, plain * s * np.where(zeroth, c, 1.0)))
    spread = sides.spread(scale, ends[:1], ends[1:], WAVELENGTH)[0]
    exact, plain, scaled = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return Shares(exact, plain, scaled, float(spread[0, 0]))


def section() -> str:
    """A part of docs/validation.md's section on light that goes through."""
    rows = []
    for theta in ANGLES:
        for azimuth in AZIMUTHS:
            found = shares(theta, azimuth)
            rows.append([
                f"{theta:g}°, {azimuth:g}°",
                *(f"{one.sum():.3f}" for one in (found.exact, found.plain, found.scaled)),
                f"{found.spread:.3f}",
                *(percent(found.off(one)) for one in (found.plain, found.scaled)),
                percent(found.in_strongest()),
            ])  # fmt: skip
    header = [
        "light", "R + T, rigorous", "as it is", "scaled", "spread", "orders off, as they are",
        "scaled", f"of what is missing, in the {STRONGEST} strongest",
    ]  # fmt: skip
    return f"""Is what is spread where it belongs? An interface of {PERIOD:g}/{DEPTH:g} µm
with a sloped return flank (slopes of 0.1 and 0.34), light from above at {WAVELENGTH:g} nm,
across the grooves from either side, beside Rayleigh's expansion; *off* is Σ|η − η_rigorous| over
all orders of both sides:

{table(header, rows)}"""
