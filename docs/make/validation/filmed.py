"""Rigorous solutions of gratings under a film that follows their heights, by Rayleigh's expansion.

The lower face is the upper one displaced by the film's thickness d along the vertical. In the plane
across the grooves a scalar u stands for either polarisation, E along the grooves (TE, η = 1) or H
(TM, η = ε), and u and ∂u/∂N / η are continuous at both faces. Above, u is the incident wave and
outgoing ones, in the film waves go up and down, below they go down; each is taken to hold as far as
the faces (Rayleigh; see `rayleigh` for how far that goes). Projected on exp(iα_n x),

    ⟨exp(i(α_m−α_n)x) exp(iβz(x))⟩   and   ⟨(β − z'α_m) exp(i(α_m−α_n)x) exp(iβz(x))⟩ / η

of a wave (α_m, β) at the face z(x). Time exp(−iωt), lengths over 2π/λ.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from mitsuba_diffraction.arrays import Complex, Real
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.reference.fresnel import decaying_root

from .cases import FEW_WAVELENGTHS, Case, Grating, Light, Media
from .compare import compare, table_of
from .models import ANGLES, of_colours
from .solutions import Orders, Solutions, Solved, stored

#: Films on materials, by name.
FILMS = {
    "wax on keratin": Media("keratin", (1.44, 150.0)),
    "titania on keratin": Media("keratin", (2.4, 100.0)),
    "oxide on silicon": Media("silicon", (1.46, 300.0)),
    "oxide on aluminium": Media("aluminium", (1.77, 250.0)),
    "lacquer on aluminium": Media("aluminium", (1.5 + 0.02j, 700.0)),
}
#: Steepest slopes of 0.03, 0.06, 0.1 and 0.1: of two, narrow and wide.
GRATINGS = tuple(
    Grating("sinusoidal", *lengths)
    for lengths in ((2.5, 0.025), (2.5, 0.05), (2.5, 0.08), (1.1, 0.035))
)


def name() -> str:
    """Name of the solver."""
    return "Rayleigh's expansion at both faces (docs/make/validation/filmed.py)"


def file_of(film: str) -> str:
    """Name of the file of a film's solutions, without its suffix."""
    return f"film_{film.replace(' ', '_')}"


def resolutions(case: Case) -> tuple[int, int]:
    """Highest orders of the expansion: first and finally."""
    return 14, 18


def solve(case: Case, harmonics: int) -> Orders:
    """Efficiencies of every order of a grating in light across the grooves."""
    grating, wavelength = case.surface, case.light.wavelength
    assert isinstance(grating, Grating)
    assert case.media.film is not None
    assert case.index is not None
    film, thickness = case.media.film
    m = np.arange(-harmonics, harmonics + 1)
    alpha = m * wavelength / 1000 / grating.period - case.wi[0]
    epsilons = 1.0, film**2, case.index**2
    above, within, below = (decaying_root(e - alpha**2 + 0j) for e in epsilons)
    heights = grating.field.heights[0] * float(wavenumber(wavelength))
    heights = heights - heights.mean()
    through = np.exp(1j * within * (2 * np.pi * thickness / wavelength))
    powers = []
    for eta in ((1.0, 1.0, 1.0), epsilons):
        outer, into, rising, falling, under = (
            _projected(heights, alpha, beta, eta[medium])
            for medium, beta in ((0, above), (0, -above), (1, within), (1, -within), (2, -below))
        )
        zero = np.zeros_like(outer)
        matrix = np.block(
            [[outer, -rising * through, -falling, zero], [zero, rising, falling * through, -under]]
        )
        came = np.zeros(2 * len(outer), complex)
        came[: len(outer)] = -into[:, harmonics]
        scale = np.abs(matrix).max(axis=0)
        amplitudes = (np.linalg.solve(matrix / scale, came) / scale)[: len(m)]
        powers.append(np.abs(amplitudes) ** 2 * above.real / above[harmonics].real)
    return Orders(case.orders, np.stack(powers, axis=1)[case.orders[:, 0] + harmonics])


def _projected(heights: Real, alpha: Real, beta: Complex, eta: complex) -> Complex:
    """Both conditions' rows (2n, n) of waves (α, β) at a face of these heights."""
    count = len(heights)
    # by the spectrum of the heights: the slope, per unit of length over 2π/λ
    step = (alpha[1] - alpha[0]) * np.fft.fftfreq(count, 1 / count)
    slope = np.fft.ifft(1j * step * np.fft.fft(heights)).real
    wave = np.exp(1j * beta[:, None] * heights)
    flux = (beta[:, None] - slope * alpha[:, None]) * wave / eta
    m = np.arange(len(alpha))
    difference = (m[:, None] - m) % count
    rows = [np.fft.fft(part, axis=1)[m, difference] / count for part in (wave, flux)]
    return np.concatenate(rows)


class FilmDeviations(NamedTuple):
    """Deviations of colours under a film by both models, each (gratings, angles)."""

    name: str
    media: Media
    kirchhoff: Real
    default: Real


def deviations(film: str) -> FilmDeviations:
    """Compare both models with the stored solutions of one of `FILMS`."""
    media = FILMS[film]
    solved = stored(file_of(film), media)
    by_model = (compare(solved, model) for model in ("kirchhoff", "small_slope"))
    tables = (table_of(part, GRATINGS, ANGLES, of_colours) for part in by_model)
    return FilmDeviations(film, media, *tables)


class Beyond(NamedTuple):
    """Deviation under lacquer on a sinusoid of 2.5 µm at 60°; thickness in nm, depth in µm."""

    thickness: float
    depth: float
    deviation: float


def beyond() -> list[Beyond]:
    """Compare the model under thicker films and on deeper gratings than those that are stored."""
    compared = []
    for thickness, depth in ((700.0, 0.12), (1400.0, 0.05), (1400.0, 0.08)):
        media = Media("aluminium", (1.5 + 0.02j, thickness))
        solved = []
        for wavelength in FEW_WAVELENGTHS:
            light = Light(wavelength, ANGLES[-1])
            case = Case(Grating("sinusoidal", 2.5, depth), light, media)
            both = (solve(case, harmonics) for harmonics in resolutions(case))
            solved.append(Solved.between(case, *both))
        found = compare(Solutions(solved), "small_slope")
        compared.append(Beyond(thickness, depth, of_colours(found)))
    return compared
