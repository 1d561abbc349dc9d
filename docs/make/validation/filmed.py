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
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction import reference
from mitsuba_diffraction.optics.blend import ScaleRoughness
from mitsuba_diffraction.optics.fresnel import Filmed, decaying_root
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, wavenumber
from mitsuba_diffraction.optics.mean_second_order import mean_gain
from mitsuba_diffraction.progress import Progress, silent

from .cases import ALUMINIUM, FEW_WAVELENGTHS, KERATIN, PROFILES, Grating, order_sines
from .compare import GRAZING
from .markdown import percent, table
from .model import in_plane, lobe_sigma
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
        """What the file of its solutions is called."""
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
#: The default model without the mean of the second order.
FIRST = "first order"


def name() -> str:
    """What solved."""
    return "Rayleigh's expansion at both faces (docs/make/validation/filmed.py)"


def solve(grating: Grating, stack: Stack, theta: float, wavelength: float, harmonics: int) -> Real:
    """Efficiencies of the orders of `cases.order_sines`, (2, orders): TE and TM."""
    orders, _ = order_sines(grating.period, wavelength, theta)
    found, above = _amplitudes(grating, stack, np.sin(np.radians(theta)), wavelength, harmonics)
    power = np.abs(found) ** 2 * above.real / above[harmonics].real
    return np.asarray(power[:, orders + harmonics])


def _amplitudes(
    grating: Grating, stack: Stack, sine: float, wavelength: float, harmonics: int
) -> tuple[Complex, Complex]:
    """Of all orders, (2, n), and their q above."""
    m = np.arange(-harmonics, harmonics + 1)
    alpha = m * wavelength / 1000 / grating.period - sine
    epsilons = 1.0, stack.film**2, stack.index[wavelength] ** 2
    above, within, below = (decaying_root(e - alpha**2 + 0j) for e in epsilons)
    heights = grating.heights(_PIXELS).heights[0] * float(wavenumber(wavelength))
    heights = heights - heights.mean()
    depth = 2 * np.pi * stack.thickness / wavelength
    through = np.exp(1j * within * depth)
    found = []
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
        found.append((np.linalg.solve(matrix / scale, came) / scale)[: len(m)])
    return np.asarray(found), above


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
    """What is kept of one of `STACKS`."""
    with resources.as_file(resources.files(__package__) / "data" / stack.file) as path:
        return load(path)


def deviations(stack: Stack, model: str) -> Real:
    """Σ|η − η_rigorous| / Σ η_rigorous of colours, (gratings, angles); orders within `GRAZING`."""
    kept = shipped_film(stack)
    found = np.zeros((2, len(GRATINGS), len(ANGLES)))
    for grating, theta, wavelength in _cases():
        orders, sines = order_sines(grating.period, wavelength, theta)
        exact = kept.where(
            period=grating.period, depth=grating.depth, theta=theta, wavelength=wavelength
        ).mean
        counted = _counted(orders, sines)
        off = np.abs(model_of(grating, stack, theta, wavelength, model) - exact)
        place = GRATINGS.index(grating), ANGLES.index(theta)
        found[(0, *place)] += off[counted].sum()
        found[(1, *place)] += exact[counted].sum()
    return np.asarray(found[0] / found[1])


def model_of(grating: Grating, stack: Stack, theta: float, wavelength: float, model: str) -> Real:
    """The model's efficiencies of the orders, for unpolarised light."""
    if model == FIRST:
        default = model_of(grating, stack, theta, wavelength, "small_slope")
        return default / _of_mean(grating, stack, theta, wavelength)
    _, sines = order_sines(grating.period, wavelength, theta)
    sigma, index = lobe_sigma(grating), stack.index[wavelength]
    brdf = reference.brdf(
        grating.heights(), in_plane(np.sin(np.radians(theta))), in_plane(sines), wavelength,
        coherence_width=WIDTHS_PER_SIGMA * sigma, model=model,
        eta=index.real, k=index.imag, film=(stack.film, stack.thickness),
    )  # fmt: skip
    return np.asarray(brdf * np.pi / (sigma * float(wavenumber(wavelength))) ** 2)


def _of_mean(grating: Grating, stack: Stack, theta: float, wavelength: float) -> Real:
    """g(ωi) g(ωo) of the orders, by which the default model differs from its first order."""
    field, k = grating.heights(), float(wavenumber(wavelength))
    film = Filmed(stack.index[wavelength], stack.film, k * stack.thickness * 1e-3)
    _, sines = order_sines(grating.period, wavelength, theta)
    cosines = np.sqrt(1.0 - np.append(sines, np.sin(np.radians(theta))) ** 2)
    roughness = ScaleRoughness.of(field.heights, field.pixel_size)
    found = mean_gain(cosines, film, roughness, k)
    return np.asarray(found[:-1] * found[-1])


def section(chosen: Sequence[Stack] = STACKS) -> str:
    """The section of docs/validation.md."""
    rows, worst = [], np.zeros(3)
    for stack in chosen:
        found = [deviations(stack, model) for model in ("kirchhoff", FIRST, "small_slope")]
        worst = np.maximum(worst, [one.max() for one in found])
        for grating, *all_three in zip(GRATINGS, *found, strict=True):
            cells = [" / ".join(map(percent, one)) for one in zip(*all_three, strict=True)]
            rows.append([stack.name, f"{grating.period:g}/{grating.depth:g} µm", *cells])
    header = ["film", "sinusoid", *(f"{theta:g}°" for theta in ANGLES)]
    stacks = "; ".join(f"{s.name}: {s.film:g}, {s.thickness:g} nm" for s in chosen)
    return f"""## Under a film

A film that follows the heights (`film_ior`, `film_k`, `film_thickness`), against Rayleigh's
expansion at both of its faces (docs/make/validation/filmed.py), steepest slopes from 0.03 to 0.1.
Index and thickness: {stacks}.
Deviation of colours, Kirchhoff's model / small slope of first order / the default, which has the
mean of the second order as well ([theory.md](theory.md#the-material)):

{table(header, rows)}

Asked was 10 %: at worst the default is {percent(worst[2])} off,
the first order {percent(worst[1])}.

The film's kernel is that of first-order perturbation of both faces, displaced alike, and as right
on gentle slopes as the bare surface's. Of the lacquer the second order counts in oblique light:
light that is diffracted twice meets the film's fringes at the order in between, and they are
narrower in angle than the orders are apart. What is diffracted there and back is most of it, a
factor of either direction alone. It takes the heights' spectrum, and has it from the roughness that
a table keeps, as if it were isotropic; waves in between count as they are on another part of the
fringes, so that films of wide fringes have little of it and bare surfaces none, where it brings
nothing (see above).

Beyond these: {_beyond()}.
The plugin warns of such films, thick on metals that are rough beside them."""


def _beyond() -> str:
    """Thicker films and higher gratings than those that are kept."""
    lacquer, theta = STACKS[-1], ANGLES[-1]
    found = []
    for thickness, depth in ((700.0, 0.12), (1400.0, 0.05), (1400.0, 0.08)):
        stack, grating = replace(lacquer, thickness=thickness), Grating("sinusoidal", 2.5, depth)
        exact = {w: solve(grating, stack, theta, w, _HARMONICS[-1]) for w in FEW_WAVELENGTHS}
        sums = np.zeros((2, 2))
        for wavelength, powers in exact.items():
            counted = _counted(*order_sines(grating.period, wavelength, theta))
            for n, model in enumerate((FIRST, "small_slope")):
                found_here = model_of(grating, stack, theta, wavelength, model)
                off = np.abs(found_here - powers.mean(axis=0))[counted].sum()
                sums[n] += off, powers.mean(axis=0)[counted].sum()
        first, default = (percent(float(off / light)) for off, light in sums)
        found.append(f"{thickness:g} nm on 2.5/{depth:g} µm {first} / {default}")
    return f"lacquer at {theta:g}°, first order / default, {', '.join(found)}"


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
