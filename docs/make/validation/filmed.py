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

import datetime
from collections.abc import Iterator
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import reference
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, wavenumber
from mitsuba_diffraction.progress import Progress, silent
from mitsuba_diffraction.reference.fresnel import decaying_root

from .cases import ALUMINIUM, FEW_WAVELENGTHS, KERATIN, PROFILES, Grating, order_sines
from .compare import GRAZING
from .model import LOBE_SIGMA, in_plane
from .solutions import ROW, Solutions, load, save_rows

Complex = NDArray[np.complex128]
Real = NDArray[np.float64]


@dataclass(frozen=True)
class Stack:
    """A film on a material; indices by wavelength (nm), thickness in nm."""

    name: str
    index: dict[float, complex]
    film: complex
    thickness: float

    @property
    def file(self) -> str:
        """Name of the file of solutions."""
        return f"film_{self.name.replace(' ', '_')}.npz"


#: Silicon's index by wavelength (nm): Mitsuba's own table (material `Si`), interpolated.
SILICON = {460.0: 4.577 + 0.130j, 610.0: 3.906 + 0.022j}
STACKS = (
    Stack("wax on keratin", dict.fromkeys(FEW_WAVELENGTHS, KERATIN + 0j), 1.44, 150.0),
    Stack("titania on keratin", dict.fromkeys(FEW_WAVELENGTHS, KERATIN + 0j), 2.4, 100.0),
    Stack("oxide on silicon", SILICON, 1.46, 300.0),
    Stack("oxide on aluminium", ALUMINIUM, 1.77, 250.0),
    Stack("lacquer on aluminium", ALUMINIUM, 1.5 + 0.02j, 700.0),
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
    epsilons = 1.0, stack.film**2, stack.index[wavelength] ** 2
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


def solve_films(folder: Path, progress: Progress | None = None) -> list[Path]:
    """Solutions of all `STACKS`, written to files.

    Raises
    ------
    DiffractionError
        If a file cannot be written.
    """
    tell = progress or silent
    paths = []
    for n, stack in enumerate(STACKS):
        tell(n, len(STACKS), f"solving {stack.name}")
        rows = np.concatenate([_rows(stack, *case) for case in _cases()])
        paths.append(folder / stack.file)
        save_rows(rows, _about(stack), paths[-1])
    tell(len(STACKS), len(STACKS), "done")
    return paths


def shipped_film(stack: Stack) -> Solutions:
    """Stored solutions of one of `STACKS`."""
    with resources.as_file(resources.files(__package__) / "data" / stack.file) as path:
        return load(path)


def deviations(stack: Stack, model: str) -> Real:
    """Σ|η − η_rigorous| / Σ η_rigorous of colours, (gratings, angles); orders within `GRAZING`."""
    solutions = shipped_film(stack)
    sums = np.zeros((2, len(GRATINGS), len(ANGLES)))
    for grating, theta, wavelength in _cases():
        orders, sines = order_sines(grating.period, wavelength, theta)
        exact = solutions.where(
            period=grating.period, depth=grating.depth, theta=theta, wavelength=wavelength
        ).mean
        counted = _counted(orders, sines)
        off = np.abs(model_of(grating, stack, theta, wavelength, model) - exact)
        place = GRATINGS.index(grating), ANGLES.index(theta)
        sums[(0, *place)] += off[counted].sum()
        sums[(1, *place)] += exact[counted].sum()
    return np.asarray(sums[0] / sums[1])


@dataclass(frozen=True)
class FilmDeviations:
    """Deviations of colours under a film by both models, each (gratings, angles)."""

    stack: Stack
    kirchhoff: Real
    default: Real


def compare_models(stack: Stack) -> FilmDeviations:
    """Compare both models with the stored solutions of a film."""
    return FilmDeviations(stack, deviations(stack, "kirchhoff"), deviations(stack, "small_slope"))


def model_of(grating: Grating, stack: Stack, theta: float, wavelength: float, model: str) -> Real:
    """The model's efficiencies of the orders, for unpolarised light."""
    _, sines = order_sines(grating.period, wavelength, theta)
    index = stack.index[wavelength]
    brdf = reference.brdf(
        grating.heights(), in_plane(np.sin(np.radians(theta))), in_plane(sines), wavelength,
        coherence_width=WIDTHS_PER_SIGMA * LOBE_SIGMA, model=model,
        eta=index.real, k=index.imag, film=(stack.film, stack.thickness),
    )  # fmt: skip
    return np.asarray(brdf * np.pi / (LOBE_SIGMA * float(wavenumber(wavelength))) ** 2)


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
        off = light = 0.0
        for wavelength in FEW_WAVELENGTHS:
            exact = solve(grating, stack, theta, wavelength, _HARMONICS[-1]).mean(axis=0)
            counted = _counted(*order_sines(grating.period, wavelength, theta))
            found = model_of(grating, stack, theta, wavelength, "small_slope")
            off += float(np.abs(found - exact)[counted].sum())
            light += float(exact[counted].sum())
        compared.append(Beyond(thickness, depth, off / light))
    return compared


def _counted(orders: NDArray[np.int64], sines: Real) -> NDArray[np.bool_]:
    """Which orders are colours."""
    return np.asarray((orders != 0) & (np.abs(sines) <= np.sin(np.radians(GRAZING))))


def _cases() -> Iterator[tuple[Grating, float, float]]:
    for grating in GRATINGS:
        for theta in ANGLES:
            for wavelength in FEW_WAVELENGTHS:
                yield grating, theta, wavelength


def _rows(stack: Stack, grating: Grating, theta: float, wavelength: float) -> NDArray[np.void]:
    coarse, fine = (solve(grating, stack, theta, wavelength, n) for n in _HARMONICS)
    orders, _ = order_sines(grating.period, wavelength, theta)
    rows = np.zeros(len(orders), ROW)
    rows["profile"] = PROFILES.index(grating.profile)
    rows["period"], rows["depth"] = grating.period, grating.depth
    rows["theta"], rows["wavelength"], rows["order"] = theta, wavelength, orders
    for n, light in enumerate(("te", "tm")):
        rows[light], rows[f"{light}_change"] = fine[n], np.abs(fine - coarse)[n]
        rows[f"{light}_balance"] = np.nan
    return rows


def _about(stack: Stack) -> dict[str, object]:
    return {
        "command": "python -m docs.make.validation films",
        "date": datetime.date.today().isoformat(),
        "solver": name(),
        "material": f"{stack.name}, film of {stack.film:g}, {stack.thickness:g} nm",
        "index": ", ".join(f"{n:g} at {w:g} nm" for w, n in stack.index.items()),
    }
