"""Films, layers beneath, blocks and crossed gratings, beside closed forms and other solvers."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from mitsuba_diffraction import DiffractionWarning, HeightField, solve_orders
from mitsuba_diffraction.orders import solve
from mitsuba_diffraction.orders.solve.profiles import Profile, UnitCell, lamellar, sinusoidal
from mitsuba_diffraction.reference import fresnel

from . import crossed
from .cases import Case, Light, Media, Sampled
from .light import index_at
from .solutions import imported

#: Silica and another oxide, from the substrate upwards: indices, and thicknesses in µm.
MIRROR = (("1.46", 0.1), ("1.95", 0.075)) * 3
#: Silica ridges on a dielectric mirror for s light of 532 nm at 45°: period, depth, µm, and duty.
RIDGES = (0.3762, 0.36, 0.6)
#: Layers beneath these ridges.
BENEATH = (*(("1.46", 0.104), ("1.95", 0.073)) * 14, ("1.46", 0.05))
_HARMONICS = 6


class Compared(NamedTuple):
    """A share of light by the package, and by another program or a closed form.

    case, light : in words.
    beside : name of the other program, or of the closed form.
    """

    case: str
    light: str
    found: float
    truth: float
    beside: str


def efficiencies(
    profile: Profile, harmonics: int, theta: float, wavelength: float, *, material: str = "1.46",
    **media: Any,
) -> dict[int, np.ndarray]:  # fmt: skip
    """Return efficiencies (2,) of s and p light by order, −1 to 1, of light across the grooves.

    harmonics : of the solver that the package chooses.
    theta, wavelength : of the light, degrees and nm.
    media : more arguments of `solve_orders`.
    """
    settings = solve.Settings((wavelength, wavelength), resolution=harmonics)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)  # the table has no other light
        table = solve_orders(profile, material, theta=theta, settings=settings, **media)
    light = -np.sin(np.radians(theta)), 0.0, wavelength
    return {m: table.polarised_efficiency(*light, m) for m in (-1, 0, 1)}


def by_ikarus(theta: float, wavelength: float) -> dict[int, np.ndarray]:
    """Return efficiencies (2,) of s and p light by order, of `RIDGES` by ikarus-rcwa."""
    ikarus = imported("ikarus")
    (period, depth, duty), pixels = RIDGES, 40
    ridge = np.repeat((np.arange(pixels) < duty * pixels).astype(int)[:, None], 2, axis=1)
    solved = []
    for turn in (0.0, 90.0):
        solver = ikarus.RCWA(
            1e-6 * period, 1e-6 * period, resolution=(pixels, 2), n_orders=(_HARMONICS, 0)
        )
        solver.add_uniform_layer(np.inf, 1.0)
        solver.add_layer(1e-6 * depth, ridge, [1.0, 1.46])
        for index, thickness in reversed(BENEATH):
            solver.add_uniform_layer(1e-6 * thickness, float(index))
        solver.add_uniform_layer(np.inf, 1.46)
        solver.set_source(
            wavelength=1e-9 * wavelength, theta=theta, polarization="linear", linear_pol_angle=turn
        )
        solved.append(solver.simulate()[2])
    return {
        m: np.array([float(each.R_orders[each.order_index(m, 0)]) for each in solved])
        for m in (0, 1)
    }


def quarter_wave_reflectance(low: float, high: float, substrate: float, pairs: int) -> float:
    """Return R of layers of a quarter wavelength: Born and Wolf, section 1.6.5."""
    ratio = high**2 / substrate * (high / low) ** (2 * pairs)
    return float(((1 - ratio) / (1 + ratio)) ** 2)


def compared(quick: bool = False) -> Iterator[Compared]:
    """Yield all comparisons; those with closed forms alone if quick."""
    yield from _closed_forms()
    if not quick:
        yield from _transfer_matrices()
        yield from _ridges()
        yield from _sine()
        yield from _crossed()


def _closed_forms() -> Iterator[Compared]:
    low, high, pairs, lam = 1.46, 2.35, 5, 550.0
    thick = [(str(index), 1e-3 * lam / 4 / index) for index in (low, high)]
    beneath = [thick[1], *(thick * pairs)]
    flat = efficiencies(lamellar(0.5, 0.0), 3, 1e-3, lam, material="1.52", beneath=beneath)
    yield Compared(
        "11 layers of a quarter wavelength on glass", f"0°, {lam:g} nm",
        float(flat[0].mean()),
        quarter_wave_reflectance(low, high, 1.52, pairs), "closed form",
    )  # fmt: skip
    index = 1.5
    settings = solve.Settings((500.0, 560.0), tolerance=0.1, resolution=4)
    block = solve_orders(lamellar(0.4, 1e-7), index, block=True, settings=settings)
    for theta, from_within in ((30.0, False), (80.0, False), (30.0, True), (41.0, True)):
        x = np.sin(np.radians(theta)) * (index if from_within else 1.0)
        cosine = float(np.sqrt(1.0 - x * x))
        found = block.efficiency(x, 0.0, 530.0, 0, from_below=from_within, transmitted=True)
        side = "within" if from_within else "above"
        yield Compared(
            "a block's flat face, transmitted", f"{theta:g}° from {side}", float(found),
            1.0 - float(fresnel.reflectance(cosine, index)), "Fresnel",
        )  # fmt: skip


def _transfer_matrices() -> Iterator[Compared]:
    tmm = imported("tmm")
    lam, metal = 540.0, {"layers": [("1.38", 0.12)], "beneath": MIRROR, "substrate": "Al"}
    films = [("1.46", 0.08), ("2.3+0.01i", 0.06), ("1.38", 0.12)]
    sloped = {"material": "Al", "layers": films}
    flat = {
        "a film, a mirror of 6 layers, aluminium": (lamellar(0.5, 0.0), metal),
        "three films on aluminium, slopes": (sinusoidal(0.5, 1e-9), sloped),
    }
    aluminium = index_at("Al", lam)
    stacks = (
        ([1.0, 1.38, *(1.95, 1.46) * 3, aluminium], [120.0, *(75.0, 100.0) * 3]),
        ([1.0, 1.38, 2.3 + 0.01j, 1.46, aluminium], [120.0, 60.0, 80.0]),
    )
    for (case, (profile, media)), (indices, depths) in zip(flat.items(), stacks, strict=True):
        for theta in (10.0, 50.0):
            got = efficiencies(profile, 3, theta, lam, **media)[0]
            for name, found in zip("sp", got, strict=True):
                stack = (name, indices, [np.inf, *depths, np.inf], np.radians(theta), lam)
                light = f"{theta:g}°, {lam:g} nm, {name}"
                yield Compared(case, light, float(found), tmm.coh_tmm(*stack)["R"], "tmm")


def _ridges() -> Iterator[Compared]:
    theta, lam = 45.0, 532.0
    ours = efficiencies(lamellar(*RIDGES), _HARMONICS, theta, lam, beneath=BENEATH)
    theirs = by_ikarus(theta, lam)
    for order in (1, 0):
        for light, name in enumerate("sp"):
            found, truth = float(ours[order][light]), float(theirs[order][light])
            case = f"ridges on a mirror of 29 layers, order {order}"
            beside = "ikarus-rcwa"
            if order and name == "s":
                # Applied Optics 38, 6257
                beside += "; Hehl et al. 1999: 1 computed, 0.97 measured"
            yield Compared(case, f"{theta:g}°, {lam:g} nm, {name}", found, truth, beside)


def _sine() -> Iterator[Compared]:
    profile, index, limits = sinusoidal(0.4, 0.05), 1.5, (500.0, 560.0)
    table = solve_orders(
        profile, index, settings=solve.Settings(limits, tolerance=0.02, resolution=8), block=True
    )
    # the block below, as a thin sheet's upper side, with channels of the light above
    side = solve.Grating(profile, solve.material_of(index, limits), 1.0, limits, thin=True)
    station = side.station(1, 0, 0.3, 0.4, [0.3])
    amplitudes = solve.IntegralSolver(profile, 50).amplitudes(station)[0]
    powers = 0.5 * (np.abs(amplitudes) ** 2).sum((1, 3))
    n, y, lam = station.channels, station.along[0], 1e3 * station.wavelengths[0]
    numbers = np.concatenate([np.arange(n), station.inside])
    x = np.sqrt(1.0 - y * y) * station.sines_of(numbers)
    below = np.arange(len(numbers)) >= n
    for j in (0, len(numbers) - 1):
        within = bool(below[j])
        theta = np.degrees(np.arcsin(np.hypot(x[j], y) / (index if within else 1.0)))
        light = f"{theta:.0f}° from {'within' if within else 'above'}, {lam:.0f} nm"
        others = np.flatnonzero(numbers != numbers[j])
        for q in others[np.argsort(-powers[j, others])][:2]:
            order = numbers[j] - numbers[q]
            found = table.efficiency(
                x[j], y, lam, order, from_below=within, transmitted=bool(below[q] != within)
            )
            side_of_order = "within" if below[q] else "above"
            case = f"table of a block's sinusoidal face, order {order:d} {side_of_order}"
            case = case.replace("-", "−")
            yield Compared(case, light, float(found), float(powers[j, q]), "gratinglab")


def _crossed() -> Iterator[Compared]:
    pixels, lam, theta, phi = 48, 450.0, 30.0, 25.0
    y, x = 2.0 * np.pi * np.mgrid[:pixels, :pixels] / pixels
    lumps = 0.25 * (1.0 - np.cos(x)) * (1.0 - np.cos(y)) + 0.2 * np.sin(x)
    # without mirror planes, so that every sign shows
    field = HeightField(0.1 * (lumps + 0.1 * np.sin(x + 2.0 * y)), 0.5 / pixels)
    case = Case(Sampled(field), Light(lam, theta, phi), Media(1.5))
    x, y = -case.wi[:2]
    station = solve.CrossedStation(x, y, 1e-3 * lam, case.index, field.extent)
    solver = solve.CrossedWaves(UnitCell(field.heights, field.extent), 5)
    orders = station.orders.tolist()
    amplitudes = solver.amplitudes(station)[0, orders.index([0, 0])]
    found = (np.abs(amplitudes) ** 2).sum(axis=-1).mean(axis=0)
    solved = crossed.solve(case, (121, 16))
    for (m, n), truth in zip(solved.order.tolist(), solved.powers.mean(axis=1), strict=True):
        name = f"lumps of glass, 0.5 µm apart in x and y, order ({m}, {n})"
        light = f"{theta:g}°, azimuth {phi:g}°, {lam:g} nm"
        found_here = float(found[orders.index([m, n])])
        yield Compared(name, light, found_here, float(truth), "grcwa")
