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

import itertools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.reference.fresnel import decaying_root

from .cases import FEW_WAVELENGTHS, Grating, index_of, index_text, order_sines
from .compare import Comparison, compare, table_of
from .models import of_colours
from .solutions import Solutions, Work, order_rows, stored

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


@dataclass(frozen=True)
class Stack:
    """A film on a material of `cases.index_of`; thickness in nm."""

    name: str
    material: str
    film: complex
    thickness: float

    @property
    def file(self) -> str:
        """Name of the file of solutions, without its suffix."""
        return f"film_{self.name.replace(' ', '_')}"


STACKS = (
    Stack("wax on keratin", "keratin", 1.44, 150.0),
    Stack("titania on keratin", "keratin", 2.4, 100.0),
    Stack("oxide on silicon", "silicon", 1.46, 300.0),
    Stack("oxide on aluminium", "aluminium", 1.77, 250.0),
    Stack("lacquer on aluminium", "aluminium", 1.5 + 0.02j, 700.0),
)
#: Steepest slopes of 0.03, 0.06, 0.1 and 0.1: of two, narrow and wide.
GRATINGS = tuple(
    Grating("sinusoidal", *lengths)
    for lengths in ((2.5, 0.025), (2.5, 0.05), (2.5, 0.08), (1.1, 0.035))
)
ANGLES = (0.0, 30.0, 60.0)
#: Highest order of the expansion: first and finally.
_HARMONICS = (14, 18)
_PIXELS = 256


def name() -> str:
    """Name of the solver."""
    return "Rayleigh's expansion at both faces (docs/make/validation/filmed.py)"


def solve(grating: Grating, stack: Stack, theta: float, wavelength: float, harmonics: int) -> Real:
    """Efficiencies of the orders of `cases.order_sines`, (2, orders): TE and TM."""
    orders, _ = order_sines(grating.period, wavelength, theta)
    amplitudes, above = _amplitudes(
        grating, stack, np.sin(np.radians(theta)), wavelength, harmonics
    )
    power = np.abs(amplitudes) ** 2 * above.real / above[harmonics].real
    return np.asarray(power[:, orders + harmonics])


def _amplitudes(
    grating: Grating, stack: Stack, sine: float, wavelength: float, harmonics: int
) -> tuple[Complex, Complex]:
    """Return the amplitudes of all orders, (2, n), and their q above."""
    m = np.arange(-harmonics, harmonics + 1)
    alpha = m * wavelength / 1000 / grating.period - sine
    epsilons = 1.0, stack.film**2, index_of(stack.material, wavelength) ** 2
    above, within, below = (decaying_root(e - alpha**2 + 0j) for e in epsilons)
    heights = grating.heights(_PIXELS).heights[0] * float(wavenumber(wavelength))
    heights = heights - heights.mean()
    depth = 2 * np.pi * stack.thickness / wavelength
    through = np.exp(1j * within * depth)
    amplitudes = []
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
        amplitudes.append((np.linalg.solve(matrix / scale, came) / scale)[: len(m)])
    return np.asarray(amplitudes), above


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


def work() -> Work:
    """Return all `STACKS` on all `GRATINGS`."""
    about = {
        stack.file: {
            "solver": name(),
            "material": f"{stack.name}, film of {stack.film:g}, {stack.thickness:g} nm",
            "index": index_text(stack.material),
        }
        for stack in STACKS
    }
    cases = list(itertools.product(STACKS, GRATINGS, ANGLES, FEW_WAVELENGTHS))
    return Work(cases, _by_file, about)


def _by_file(case: tuple[Stack, Grating, float, float]) -> dict[str, NDArray[np.void]]:
    return {case[0].file: _rows(*case)}


def _rows(stack: Stack, grating: Grating, theta: float, wavelength: float) -> NDArray[np.void]:
    both = (solve(grating, stack, theta, wavelength, n) for n in _HARMONICS)
    return order_rows(grating, theta, wavelength, *both)


def deviations(stack: Stack, model: str) -> Real:
    """Deviations of colours from the stored solutions of a film, (gratings, angles)."""
    return table_of(_compared(stack, stored(stack.file), model), GRATINGS, ANGLES, of_colours)


def _compared(stack: Stack, solutions: Solutions, model: str) -> Comparison:
    return compare(stack.material, solutions, model, film=(stack.film, stack.thickness))


class FilmDeviations(NamedTuple):
    """Deviations of colours under a film by both models, each (gratings, angles)."""

    stack: Stack
    kirchhoff: Real
    default: Real


def of_stack(stack: Stack) -> FilmDeviations:
    """Compare both models with the stored solutions of a film."""
    return FilmDeviations(stack, deviations(stack, "kirchhoff"), deviations(stack, "small_slope"))


class Beyond(NamedTuple):
    """Deviation under lacquer on a sinusoid of 2.5 µm at 60°; thickness in nm, depth in µm."""

    thickness: float
    depth: float
    deviation: float


def beyond() -> list[Beyond]:
    """Compare the model under thicker films and on deeper gratings than those that are stored."""
    lacquer, theta = STACKS[-1], ANGLES[-1]
    compared = []
    for thickness, depth in ((700.0, 0.12), (1400.0, 0.05), (1400.0, 0.08)):
        stack, grating = replace(lacquer, thickness=thickness), Grating("sinusoidal", 2.5, depth)
        rows = np.concatenate([_rows(stack, grating, theta, lam) for lam in FEW_WAVELENGTHS])
        found = _compared(stack, Solutions(rows, {}), "small_slope")
        compared.append(Beyond(thickness, depth, of_colours(found)))
    return compared
