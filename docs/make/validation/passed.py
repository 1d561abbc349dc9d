"""Orders that go through a dielectric grating, beside Rayleigh's expansion (`rayleigh.through`).

That takes a fraction of a second a grating, and is done when the page is made; nothing is kept.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import reference
from mitsuba_diffraction.optics import boundary
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, wavenumber

from . import rayleigh
from .cases import FEW_WAVELENGTHS, KERATIN, Grating, order_sines
from .compare import GRAZING
from .markdown import percent, table
from .model import in_plane, lobe_sigma

Real = NDArray[np.float64]

#: Steepest slopes of 0.03, 0.06, 0.1, 0.1 and 0.2.
GRATINGS = tuple(
    Grating("sinusoidal", *lengths)
    for lengths in ((2.5, 0.025), (2.5, 0.05), (2.5, 0.08), (1.1, 0.035), (1.6, 0.1))
)
ANGLES = (0.0, 30.0, 60.0, 75.0)
#: Azimuths of the light: across the grooves, between, along.
AZIMUTHS = (0.0, 35.0, 90.0)
_HARMONICS, _PIXELS = 31, 64


def orders_of(
    grating: Grating, theta: float, azimuth: float, wavelength: float, model: str
) -> tuple[Real, Real, Real]:
    """Efficiencies by the model and rigorously, (n,), and which are colours within `GRAZING`."""
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
    rows = []
    for grating in gratings:
        for azimuth in AZIMUTHS:
            cells = [
                " / ".join(
                    percent(deviation(grating, theta, azimuth, model))
                    for model in ("kirchhoff", "small_slope")
                )
                for theta in ANGLES
            ]
            rows.append([f"{grating.period:g}/{grating.depth:g} µm", f"{azimuth:g}°", *cells])
    header = ["sinusoid", "azimuth", *(f"{theta:g}°" for theta in ANGLES)]
    return f"""## Through a dielectric

Orders that go through (`transmission`), from above into keratin, against Rayleigh's expansion, with
light across the grooves (azimuth 0°), between and along them; steepest slopes from 0.03 to 0.2.
Deviation of colours within {GRAZING:g}° of the normal, Kirchhoff's model / the default:

{table(header, rows)}

At slopes up to 0.1 the default is within 0.2 % in light along the normal, and within 3 % up to 75°.
What a thin sheet does besides is Fresnel's: its other side is flat.

Reflected and transmitted light of these gratings by the default, all orders, light at 550 nm across
the grooves; a lossless dielectric has 1:

{table(["sinusoid", *(f"{theta:g}°" for theta in ANGLES)], sums(gratings))}"""


def sums(gratings: Sequence[Grating]) -> list[list[str]]:
    """Rows of R + T."""
    rows = []
    for grating in gratings:
        field, sigma = grating.heights(_PIXELS), lobe_sigma(grating)
        per_lobe = np.pi / (sigma * float(wavenumber(550.0))) ** 2
        common = {
            "eta": KERATIN, "model": "small_slope", "coherence_width": WIDTHS_PER_SIGMA * sigma,
        }  # fmt: skip
        cells = []
        for theta in ANGLES:
            wi = in_plane(np.sin(np.radians(theta)))
            wo = in_plane(order_sines(grating.period, 550.0, theta)[1])
            total = reference.brdf(field, wi, wo, 550.0, **common).sum()
            # inside, sines are those of light in a medium of the dielectric's index
            step, sine = 0.55 / grating.period, np.sin(np.radians(theta))
            m = np.arange(np.ceil((sine - KERATIN) / step), np.floor((sine + KERATIN) / step) + 1)
            within = in_plane((m * step - sine) / KERATIN) * [1, 1, -1]
            total += reference.btdf(field, wi, within, 550.0, **common).sum()
            cells.append(f"{per_lobe * total:.3f}")
        rows.append([f"{grating.period:g}/{grating.depth:g} µm", *cells])
    return rows
