"""Transmitted orders of dielectric gratings beside Rayleigh's expansion, and R + T of surfaces.

Rayleigh's expansion takes a fraction of a second a grating (`rayleigh.through`), so the solutions
are computed with the page and not stored.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionTable, TableSource, gratings, reference
from mitsuba_diffraction.analysis.energy import sides_summary
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, wavenumber
from mitsuba_diffraction.reference import boundary

from . import rayleigh
from .cases import FEW_WAVELENGTHS, KERATIN, Grating
from .compare import GRAZING, misplaced
from .light import direction
from .model import LOBE_SIGMA

Real = NDArray[np.float64]

#: Sinusoids whose steepest slopes are 0.03, 0.06, 0.1, 0.1 and 0.2.
GRATINGS = tuple(
    Grating("sinusoidal", *lengths)
    for lengths in ((2.5, 0.025), (2.5, 0.05), (2.5, 0.08), (1.1, 0.035), (1.6, 0.1))
)
ANGLES = (0.0, 30.0, 60.0, 75.0)
#: Azimuths of the light: across the grooves, between, along.
AZIMUTHS = (0.0, 35.0, 90.0)
MODELS = ("kirchhoff", "small_slope")
#: Surfaces whose R + T is summed, by name.
SURFACES = {
    "sinusoid 2.5/0.08 µm": partial(gratings.sinusoidal, 2.5, 0.08, periods=8),
    "sinusoid 1.6/0.1 µm": partial(gratings.sinusoidal, 1.6, 0.1, periods=8),
    "CD": gratings.cd,
    "elaphe_like": gratings.elaphe_like,
    "blazed 2/0.2 µm": partial(gratings.blazed, 2.0, 0.2),
}
#: Recipes that come with the package.
PRECOMPUTE = sorted((Path(__file__).parents[3] / "precompute").glob("*.toml"))
#: Index of the surfaces and recipes.
INDEX = 1.5
_HARMONICS, _PIXELS = 31, 64


@cache
def _solved(grating: Grating, theta: float, azimuth: float, wavelength: float) -> rayleigh.Orders:
    wi = direction(theta, azimuth)
    return rayleigh.through(grating.heights(_PIXELS), KERATIN, wavelength, wi, _HARMONICS)


def _efficiencies(
    grating: Grating, theta: float, azimuth: float, wavelength: float, model: str
) -> tuple[Real, Real]:
    """Efficiencies of colours by one of `MODELS` and by Rayleigh's expansion, light from above."""
    exact, wi = _solved(grating, theta, azimuth, wavelength), direction(theta, azimuth)
    cosines = -KERATIN * exact.wo[:, 2]
    btdf = reference.btdf(
        grating.heights(_PIXELS), wi, exact.wo, wavelength,
        eta=KERATIN, coherence_width=WIDTHS_PER_SIGMA * LOBE_SIGMA, model=model,
    )  # fmt: skip
    per_btdf = np.pi / (LOBE_SIGMA * float(wavenumber(wavelength))) ** 2
    coloured = (exact.order != 0).any(axis=1) & (-exact.wo[:, 2] > np.cos(np.radians(GRAZING)))
    rigorous = boundary.unpolarised(exact.jones) * cosines / wi[2]
    return (per_btdf * btdf)[coloured], rigorous[coloured]


def deviation(grating: Grating, theta: float, azimuth: float, model: str) -> float:
    """Deviation of transmitted colours, Σ|η − η_rigorous| / Σ η_rigorous at both wavelengths."""
    parts = (_efficiencies(grating, theta, azimuth, lam, model) for lam in FEW_WAVELENGTHS)
    return misplaced(*map(np.concatenate, zip(*parts, strict=True)))


class Deviations(NamedTuple):
    """Deviations of colours on a grating at one azimuth, by model and then at `ANGLES`."""

    grating: Grating
    azimuth: float
    by_model: list[list[float]]


def deviations(chosen: Sequence[Grating] = GRATINGS) -> list[Deviations]:
    """Compare both models on gratings at all `AZIMUTHS`."""
    return [
        Deviations(
            grating,
            azimuth,
            [[deviation(grating, theta, azimuth, m) for theta in ANGLES] for m in MODELS],
        )
        for grating in chosen
        for azimuth in AZIMUTHS
    ]


class Sums(NamedTuple):
    """Least and largest R + T by angle of incidence, by the model and with energy conserved."""

    surface: str
    medium: str
    side: str
    model: dict[str, list[float]]
    conserved: dict[str, list[float]]


def sums_of_surfaces(names: Sequence[str] = tuple(SURFACES)) -> Iterator[Sums]:
    """R + T of `SURFACES` with a coherence width of 20 µm."""
    for name in names:
        table = DiffractionTable.build(
            SURFACES[name](), coherence_width=20.0, height_scale_max=INDEX
        )
        yield from _sums(name, table)


def sums_of_recipes(recipes: Sequence[Path] = tuple(PRECOMPUTE)) -> Iterator[Sums]:
    """R + T of recipes with their own coherence widths."""
    for source in map(TableSource.of, recipes):
        yield from _sums(source.files[0].stem, source.table(source.settings_for({})))


def _sums(name: str, table: DiffractionTable) -> Iterator[Sums]:
    for medium, summary in sides_summary(table).items():
        for side in ("above", "below"):
            spans = (summary[f"R + T{kind}, from {side}"] for kind in ("", ", conserved"))
            yield Sums(name, medium.split(" ")[0], side, *spans)
