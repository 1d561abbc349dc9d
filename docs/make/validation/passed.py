"""Orders that go through a dielectric grating, beside Rayleigh's expansion (`rayleigh.through`).

That takes a fraction of a second a grating, and is done when the page is made; nothing is kept.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionTable, HeightField, gratings, reference
from mitsuba_diffraction.analysis.energy import PASSED, sides_summary
from mitsuba_diffraction.heights.recipes import Recipe
from mitsuba_diffraction.optics import boundary
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, wavenumber

from . import rayleigh
from .cases import FEW_WAVELENGTHS, KERATIN, Grating
from .compare import GRAZING
from .model import lobe_sigma
from .pages.markdown import percent, table

Real = NDArray[np.float64]

#: Steepest slopes of 0.03, 0.06, 0.1, 0.1 and 0.2.
GRATINGS = tuple(
    Grating("sinusoidal", *lengths)
    for lengths in ((2.5, 0.025), (2.5, 0.05), (2.5, 0.08), (1.1, 0.035), (1.6, 0.1))
)
ANGLES = (0.0, 30.0, 60.0, 75.0)
#: Azimuths of the light: across the grooves, between, along.
AZIMUTHS = (0.0, 35.0, 90.0)
MODELS = ("kirchhoff", "small_slope")
#: Beside those whose orders are compared.
SURFACES = {
    "sinusoid 2.5/0.08 µm": partial(gratings.sinusoidal, 2.5, 0.08, periods=8),
    "sinusoid 1.6/0.1 µm": partial(gratings.sinusoidal, 1.6, 0.1, periods=8),
    "CD": gratings.cd,
    "elaphe_like": gratings.elaphe_like,
    "blazed 2/0.2 µm": partial(gratings.blazed, 2.0, 0.2),
}
#: The recipes that come with the package.
PRECOMPUTE = sorted((Path(__file__).parents[3] / "precompute").glob("*.toml"))
#: Depth over period of a sinusoid of slope 0.1, and a little.
_GENTLE = 0.033
_HARMONICS, _PIXELS = 31, 64


def orders_of(
    grating: Grating, theta: float, azimuth: float, wavelength: float, model: str
) -> tuple[Real, Real, Real]:
    """Efficiencies by the model and rigorously, (n,), and which are colours within `GRAZING`.

    model : one of `MODELS`.
    """
    field = grating.heights(_PIXELS)
    polar, turn = np.radians([theta, azimuth])
    wi = np.array([np.sin(polar) * np.cos(turn), np.sin(polar) * np.sin(turn), np.cos(polar)])
    found = rayleigh.through(field, KERATIN, wavelength, wi, _HARMONICS)
    cosines = -KERATIN * found.wo[:, 2]
    exact = boundary.unpolarised(found.jones) * cosines / wi[2]
    sigma = lobe_sigma(grating)
    btdf = reference.btdf(
        field, wi, found.wo, wavelength,
        eta=KERATIN, coherence_width=WIDTHS_PER_SIGMA * sigma, model=model,
    )  # fmt: skip
    per_btdf = np.pi / (sigma * float(wavenumber(wavelength))) ** 2
    coloured = (found.order != 0).any(axis=1) & (-found.wo[:, 2] > np.cos(np.radians(GRAZING)))
    return per_btdf * btdf, exact, coloured.astype(float)


def deviation(grating: Grating, theta: float, azimuth: float, model: str) -> float:
    """Σ|η − η_rigorous| / Σ η_rigorous of the colours that go through, at both wavelengths."""
    off = total = 0.0
    for wavelength in FEW_WAVELENGTHS:
        modelled, exact, coloured = orders_of(grating, theta, azimuth, wavelength, model)
        off += float(np.abs(modelled - exact) @ coloured)
        total += float(exact @ coloured)
    return off / total


def section(gratings: Sequence[Grating] = GRATINGS) -> str:
    """The section of docs/validation.md."""
    rows, worst = [], dict.fromkeys(ANGLES, 0.0)
    for grating in gratings:
        for azimuth in AZIMUTHS:
            found = {
                theta: [deviation(grating, theta, azimuth, model) for model in MODELS]
                for theta in ANGLES
            }
            if grating.depth / grating.period < _GENTLE:
                worst = {theta: max(worst[theta], one[-1]) for theta, one in found.items()}
            cells = [" / ".join(map(percent, found[theta])) for theta in ANGLES]
            rows.append([f"{grating.period:g}/{grating.depth:g} µm", f"{azimuth:g}°", *cells])
    header = ["sinusoid", "azimuth", *(f"{theta:g}°" for theta in ANGLES)]
    surfaces = SURFACES if len(gratings) > 1 else dict(list(SURFACES.items())[:1])
    recipes = PRECOMPUTE if len(gratings) > 1 else PRECOMPUTE[1:2]  # of few orders
    return f"""## Through a dielectric

Orders that go through (`diffraction_dielectric`), from above into keratin, against Rayleigh's
expansion, with light across the grooves (azimuth 0°), between and along them; steepest slopes from
0.03 to 0.2.
Deviation of colours within {GRAZING:g}° of the normal, Kirchhoff's model / `small_slope`, the
default; conserving energy does not change them:

{table(header, rows)}

At slopes up to 0.1 the default is within {percent(worst[0.0])} in light along the normal, and
within {percent(max(worst.values()))} up to 75°.
What a thin sheet does besides is Fresnel's: its other side is flat.

Reflected and transmitted light by `small_slope` as it is → by default, coherent over 20 µm, of an
index of 1.5: least and largest of 24 azimuths at 450, 550 and 650 nm, as `info --energy` prints it.
A lossless dielectric has 1:

{table(["surface", "light", *(f"{theta:g}°" for theta in PASSED)], sums(surfaces))}

The recipes of `precompute/`, coherent over the default 65 µm, up to 75°
(`python -m docs.make.validation passed` prints this table):

{wide(recipes)}

Order 0 alone is scaled, so colours are as the model has them; where order 0 has too little light,
what is missing stays missing, and what is too much stays too much. `energy_conserving=false` leaves
order 0 as it is."""


def wide(recipes: Sequence[Path] = PRECOMPUTE) -> str:
    """R + T of recipes up to 75°, of lobes as narrow as by default."""
    rows = []
    for recipe in map(Recipe.load, recipes):
        built = DiffractionTable.build(recipe.fields(), **recipe.table)
        cells = []
        for _, found in sorted(sides_summary(built).items(), reverse=True):  # sheets first
            for kept in (False, True):
                ends = [
                    span for key, spans in found.items() if ("conserved" in key) == kept
                    for one in spans.values() for span in one
                ]  # fmt: skip
                cells.append(_span([min(ends), max(ends)]))
        rows.append([recipe.path.stem, *cells])
    whats = "as it is", "default"
    kinds = [f"{kind}, {what}" for kind in ("sheet", "dielectric") for what in whats]
    return table(["recipe", *kinds], rows)


def sums(surfaces: dict[str, Callable[[], HeightField]]) -> list[list[str]]:
    """Rows of R + T."""
    rows = []
    for name, make in surfaces.items():
        built = DiffractionTable.build(make(), coherence_width=20.0, height_scale_max=1.5)
        for medium, found in sides_summary(built).items():
            for side in ("above", "below"):
                raw, kept = (found[f"R + T{x}, from {side}"] for x in ("", ", conserved"))
                cells = [f"{_span(raw[angle])} → {_span(kept[angle])}" for angle in raw]
                rows.append([name, f"{medium.split(' ')[0]}, {side}", *cells])
    return rows


def _span(ends: list[float]) -> str:
    return "–".join(f"{end:.3f}" for end in ends)
