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
from scipy.special import j0

from mitsuba_diffraction import reference
from mitsuba_diffraction.optics.boundary import small_slope
from mitsuba_diffraction.optics.fresnel import Filmed, decaying_root
from mitsuba_diffraction.optics.geometry import WIDTHS_PER_SIGMA, wavenumber
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
#: Of `mean_second_order`: its share of the depth, which is of the first order in a thousandth of
#: this, and the highest order.
_SMALL, _FEW = 0.02, 4
#: The default model times `mean_second_order`'s factor.
MEAN = "small_slope and the mean"


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


def mean_second_order(grating: Grating, stack: Stack, sine: float, wavelength: float) -> Complex:
    """δ of both polarisations, (2,): what order 0 is more than first order's, to h², by size.

    Of first order it is the flat film's r times J₀(κh): 1 + δ is what it is over that. An order
    that leaves along k of light along k₀ has √((1 + δ(k))(1 + δ(k₀))) of the field then, if what
    light of other orders adds has no phase of its own (random heights; Voronovich 1994).
    """
    small = Grating(grating.profile, grating.period, grating.depth * _SMALL)
    level = Grating(grating.profile, grating.period, 0.0)
    there, flat = (
        _amplitudes(one, stack, sine, wavelength, _FEW)[0][:, _FEW] for one in (small, level)
    )
    kappa = 2.0 * float(wavenumber(wavelength)) * np.sqrt(1.0 - sine**2)
    return np.asarray((there / flat / j0(0.5 * kappa * small.depth) - 1.0) / _SMALL**2)


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
        counted = (orders != 0) & (np.abs(sines) <= np.sin(np.radians(GRAZING)))
        off = np.abs(model_of(grating, stack, theta, wavelength, model) - exact)
        place = GRATINGS.index(grating), ANGLES.index(theta)
        found[(0, *place)] += off[counted].sum()
        found[(1, *place)] += exact[counted].sum()
    return np.asarray(found[0] / found[1])


def model_of(grating: Grating, stack: Stack, theta: float, wavelength: float, model: str) -> Real:
    """The model's efficiencies of the orders, for unpolarised light."""
    if model == MEAN:
        alone = model_of(grating, stack, theta, wavelength, "small_slope")
        return alone * _dressed(grating, stack, theta, wavelength)
    _, sines = order_sines(grating.period, wavelength, theta)
    sigma, index = lobe_sigma(grating), stack.index[wavelength]
    brdf = reference.brdf(
        grating.heights(), in_plane(np.sin(np.radians(theta))), in_plane(sines), wavelength,
        coherence_width=WIDTHS_PER_SIGMA * sigma, model=model,
        eta=index.real, k=index.imag, film=(stack.film, stack.thickness),
    )  # fmt: skip
    return np.asarray(brdf * np.pi / (sigma * float(wavenumber(wavelength))) ** 2)


def _dressed(grating: Grating, stack: Stack, theta: float, wavelength: float) -> Real:
    """|(1 + δ(k))(1 + δ(k₀))| of the orders, the mean of both polarisations by their power."""
    _, sines = order_sines(grating.period, wavelength, theta)
    sine = float(np.sin(np.radians(theta)))
    came = mean_second_order(grating, stack, sine, wavelength)
    left = [mean_second_order(grating, stack, float(one), wavelength) for one in sines]
    factor = np.abs((1.0 + came) * (1.0 + np.stack(left)))
    depth = wavenumber(wavelength) * stack.thickness * 1e-3
    film = Filmed(stack.index[wavelength], stack.film, depth)
    wi, wo = np.broadcast_arrays(in_plane(sine), in_plane(sines))
    jones = small_slope(wi, wo, film)
    power = np.abs(np.stack([jones[:, 0, 0], jones[:, 1, 1]], axis=1)) ** 2
    return np.asarray(np.sum(power * factor, axis=1) / np.sum(power, axis=1))


def section(chosen: Sequence[Stack] = STACKS) -> str:
    """The section of docs/validation.md."""
    rows = []
    for stack in chosen:
        found = [deviations(stack, model) for model in ("kirchhoff", "small_slope", MEAN)]
        for grating, *all_three in zip(GRATINGS, *found, strict=True):
            cells = [" / ".join(map(percent, one)) for one in zip(*all_three, strict=True)]
            rows.append([stack.name, f"{grating.period:g}/{grating.depth:g} µm", *cells])
    header = ["film", "sinusoid", *(f"{theta:g}°" for theta in ANGLES)]
    stacks = "; ".join(f"{s.name}: {s.film:g}, {s.thickness:g} nm" for s in chosen)
    return f"""## Under a film

A film that follows the heights (`film_ior`, `film_k`, `film_thickness`), against Rayleigh's
expansion at both of its faces (docs/make/validation/filmed.py), steepest slopes from 0.03 to 0.1.
Index and thickness: {stacks}.
Deviation of colours, Kirchhoff's model / the default / the default times the mean of what the
second order adds to light that keeps its direction:

{table(header, rows)}

The film's kernel is that of first-order perturbation of both faces, displaced alike, and as right
on gentle slopes as the bare surface's. Of the lacquer the second order counts in oblique light:
light that is diffracted twice meets the film's fringes at the order in between, and they are
narrower in angle than the orders are apart. The deviation grows as the square of the heights, and
with the angle; by wavelength it does not follow where an evanescent order meets a guided mode of
the film. The plugin warns of such films.

The film's thickness across its faces, less by half the mean squared slope than the vertical one, is
not it: {_thickness()}.
What light that is diffracted there and back does to a wave is most of it, δ of
`filmed.mean_second_order`: it brings the lacquer below 10 %. Of other films, whose fringes are
wide, it makes about as many cases worse as better, as of bare surfaces (see above), and it takes
the spectrum of the heights, for every direction and wavelength: it is not in the model."""


def _thickness() -> str:
    """By how much a film would have to be other for the default model to be right."""
    stack, grating, theta = STACKS[-1], GRATINGS[2], ANGLES[-1]
    exact = {
        w: solve(grating, stack, theta, w, _HARMONICS[-1]).mean(axis=0) for w in FEW_WAVELENGTHS
    }

    def off(thickness: float) -> float:
        other = replace(stack, thickness=thickness)
        found = 0.0
        for wavelength, powers in exact.items():
            orders, sines = order_sines(grating.period, wavelength, theta)
            counted = (orders != 0) & (np.abs(sines) <= np.sin(np.radians(GRAZING)))
            model = model_of(grating, other, theta, wavelength, "small_slope")
            found += float(np.abs(model - powers)[counted].sum() / powers[counted].sum())
        return found / len(exact)

    nodes = stack.thickness * np.linspace(0.9, 1.1, 81)
    best = float(nodes[np.argmin([off(one) for one in nodes])])
    slope = np.pi * grating.depth / grating.period
    less = stack.thickness * slope**2 / 4.0
    now, then = percent(off(stack.thickness)), percent(off(best))
    return (
        f"of the {stack.name} on {grating.period:g}/{grating.depth:g} µm at {theta:g}° the model "
        f"is nearest with {best:.0f} nm\n({then} off; {now} with {stack.thickness:g} nm), where "
        f"slopes take {less:.1f} nm"
    )


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
