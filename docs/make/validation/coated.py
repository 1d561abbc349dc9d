"""Rigorous solutions of coated gratings: orders that go back and forth between coat and structure.

Under a clear coat of index n, thick and uneven enough that powers add up, an order m of the light
inside is the plane wave of tangential part sinθo/n that every solver can be asked for: E[l, m] is
the share of light coming down in order m that goes up in order l. The face transmits T_m of it and
sends R_m back, all of it beyond the critical angle. With light T_0 coming in, the powers p that go
up are

    p = E (e_0 T_0 + R p) = (1 − E R)⁻¹ E e_0 T_0,   and T p leaves; R_0 of order 0 never came in.

In the plane across the grooves s and p light stay apart, and this is exact for each.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.reference.fresnel import amplitudes

from . import integral, rayleigh
from .cases import COAT, FEW_WAVELENGTHS, Grating, Scan, index_of, index_text, order_sines
from .compare import compare
from .model import LOBE_SIGMA, efficiencies, in_plane, jones_of, shares
from .solutions import LIGHTS, Work, order_rows, stored

Real = NDArray[np.float64]

#: What is solved: sinusoids as far as Rayleigh's expansion goes, and edges.
GRATINGS = (
    *(
        Grating("sinusoidal", period, depth)
        for period, depth in (
            (2.5, 0.05), (2.5, 0.1), (1.1, 0.05), (1.6, 0.1), (2.5, 0.2), (1.1, 0.1),
        )
    ),
    Grating("lamellar", 1.6, 0.1),
    Grating("blazed", 1.6, 0.1),
)  # fmt: skip
ANGLES = (0.0, 30.0, 60.0)

#: As `index_of` knows it, at wavelengths in the coat.
MATERIAL = "aluminium under polycarbonate"
#: Without what the face sends back to the structure, and with it.
SERIES = ("single", "bounced")
#: Name of the file of one of `SERIES`, without its suffix.
FILE = "aluminium_coated_{}"

# (first, final) of the solvers: harmonics; points on the boundary
_HARMONICS = (31, 61)


def work() -> Work:
    """Return all `GRATINGS`, each of which is solved for all `SERIES`."""
    about = {
        "solver": f"{rayleigh.name()}; lamellar and blazed: {integral.name()}",
        "index": index_text("aluminium"),
    }
    media = f"aluminium under a coat of index {COAT:g}"
    return Work(
        list(itertools.product(GRATINGS, ANGLES, FEW_WAVELENGTHS)),
        _by_file,
        {FILE.format(series): about | {"material": f"{media}, {series}"} for series in SERIES},
    )


def _by_file(case: tuple[Grating, float, float]) -> dict[str, NDArray[np.void]]:
    return {FILE.format(series): rows for series, rows in solve_one(*case).items()}


def solve_one(grating: Grating, theta: float, wavelength: float) -> dict[str, NDArray[np.void]]:
    """Rows of a grating in light of one direction (degrees) and wavelength (nm), by series."""
    orders, sines = order_sines(grating.period, wavelength, theta)
    inside = inner_orders(grating.period, wavelength, theta)
    outside = np.isin(inside, orders)
    first, final = (
        _matrices(grating, theta, wavelength, inside, fine=fine) for fine in (False, True)
    )
    cosine = np.sqrt(1 - sines**2)
    faces = np.abs(amplitudes(cosine, COAT)) ** 2
    return {
        series: order_rows(
            grating, theta, wavelength,
            *(
                [leaving(each[n], faces[n], outside, orders, series=series) for n in range(2)]
                for each in (first, final)
            ),
        )
        for series in SERIES
    }  # fmt: skip


def leaving(
    matrix: Real, face: Real, outside: NDArray[np.bool_], orders: NDArray[np.int64], *, series: str
) -> Real:
    """Efficiencies of the orders that leave the coat, from E (inner, inner) and R of the face.

    face : (orders,) of those that leave; outside : which of the inner orders these are.
    """
    back = np.ones(len(matrix))  # beyond the critical angle
    back[outside] = face
    zeroth = np.flatnonzero(outside)[orders == 0][0]
    came = matrix[:, zeroth] * (1.0 - back[zeroth])
    up = came if series == "single" else np.linalg.solve(np.eye(len(matrix)) - matrix * back, came)
    out = ((1.0 - back) * up)[outside]
    out[orders == 0] += face[orders == 0]
    return np.asarray(out)


def inner_orders(period: float, wavelength: float, theta: float) -> NDArray[np.int64]:
    """Orders that propagate inside the coat."""
    step, sine = wavelength / 1000 / period, np.sin(np.radians(theta))
    return np.arange(np.ceil((sine - COAT) / step), np.floor((sine + COAT) / step) + 1).astype(int)


@dataclass(frozen=True)
class CoatDeviation:
    """Deviation of colours of the default under a coat, for light from one angle.

    Attributes
    ----------
    theta : angle of incidence, degrees.
    single : deviation for light that is diffracted once in the coat.
    bounced : deviation for all light.
    share : part of the rigorous colours that the coat's face has returned at least once.
    """

    grating: Grating
    theta: float
    single: float
    bounced: float
    share: float


def deviations(gratings: Sequence[Grating] = GRATINGS) -> list[CoatDeviation]:
    """Compare the default with the stored solutions of these gratings."""
    solved = [stored(FILE.format(series)) for series in SERIES]
    compared = []
    for grating in gratings:
        for theta in ANGLES:
            single, bounced = (
                compare(
                    "aluminium", each.where(grating=grating, theta=theta), "small_slope", coat=COAT
                )
                for each in solved
            )
            once = np.concatenate([_once(grating, theta, w) for w in FEW_WAVELENGTHS])
            coloured = bounced.counted & (bounced.solutions.rows["order"] != 0)
            share = 1 - single.rigorous[coloured].sum() / bounced.rigorous[coloured].sum()
            deviation = CoatDeviation(
                grating,
                theta,
                replace(single, model=once).deviation(colours=True),
                bounced.deviation(colours=True),
                float(share),
            )
            compared.append(deviation)
    return compared


def _once(grating: Grating, theta: float, wavelength: float) -> Real:
    """Efficiencies by the default of light that is diffracted once, without the face's own."""
    _, sines = order_sines(grating.period, wavelength, theta)
    sine, field = np.sin(np.radians(theta)), grating.heights()
    light = in_plane(sine / COAT), in_plane(sines / COAT), wavelength / COAT
    index = index_of(MATERIAL, wavelength / COAT)
    inside = efficiencies(field, index, *light, "small_slope", sigma=LOBE_SIGMA)
    by_light = inside[:, None] * shares(jones_of(field, index, *light, "small_slope"))
    through = np.stack(
        [
            (1 - np.abs(there) ** 2) * (1 - np.abs(back) ** 2)
            for there, back in zip(
                amplitudes(in_plane(sine)[2], COAT),
                amplitudes(in_plane(sines)[:, 2], COAT),
                strict=True,
            )
        ],
        axis=1,
    )
    return np.asarray((by_light * through).mean(axis=1))


def _matrices(
    grating: Grating, theta: float, wavelength: float, inside: NDArray[np.int64], *, fine: bool
) -> Real:
    """E of both polarisations, (2, inner, inner): from the column's order to the row's."""
    matrices = np.zeros((2, len(inside), len(inside)))
    for column, order in enumerate(inside):
        # going down in order m is light from −sin of it
        sine = (np.sin(np.radians(theta)) - order * wavelength / 1000 / grating.period) / COAT
        for relative, powers in _reflected(grating, float(sine), wavelength / COAT, fine=fine):
            row = np.flatnonzero(inside == order + relative)
            if len(row):
                matrices[:, row[0], column] = powers
    return matrices


def _reflected(
    grating: Grating, sine: float, wavelength: float, *, fine: bool
) -> Iterator[tuple[int, Real]]:
    """Orders and their efficiencies (2,), TE and TM, of light inside the coat."""
    if grating.profile == "sinusoidal":
        wi = in_plane(sine)
        reflected = rayleigh.solve(
            grating.heights(256), index_of(MATERIAL, wavelength), wavelength, wi, _HARMONICS[fine]
        )
        power = np.abs(np.diagonal(reflected.jones, axis1=1, axis2=2)) ** 2
        for order, share, cosine in zip(
            reflected.order[:, 0], power, reflected.wo[:, 2], strict=True
        ):
            yield int(order), share * cosine / wi[2]
        return
    scan = Scan(grating, MATERIAL, float(np.degrees(np.arcsin(sine))), (wavelength,))
    solution = integral.solve(scan, integral.resolutions(scan)[fine])
    orders, _ = order_sines(grating.period, wavelength, scan.theta)
    powers = np.stack([solution.orders[light][0] for light in LIGHTS], axis=1)
    yield from zip(orders.tolist(), powers, strict=True)
