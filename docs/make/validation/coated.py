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

import datetime
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.progress import Progress, silent
from mitsuba_diffraction.reference.fresnel import amplitudes

from . import integral, rayleigh
from .cases import ALUMINIUM, COAT, FEW_WAVELENGTHS, PROFILES, Grating, Scan, index_of, order_sines
from .compare import compare
from .model import LOBE_SIGMA, efficiencies, in_plane, jones_of, shares
from .solutions import ROW, Solutions, load, save_rows

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

# (first, final) of the solvers: harmonics; points on the boundary
_HARMONICS = (31, 61)


def coated_file(series: str) -> str:
    """Name of the file of solutions of one of `SERIES`."""
    return f"aluminium_coated_{series}.npz"


def solve_coated(folder: Path, progress: Progress | None = None) -> dict[str, NDArray[np.void]]:
    """Solve all `GRATINGS` for each of `SERIES`, and write the rows to files after each grating.

    Raises
    ------
    DiffractionError
        If gratinglab is not installed, or a file cannot be written.
    """
    tell = progress or silent
    by_series = {series: np.empty(0, ROW) for series in SERIES}
    for n, grating in enumerate(GRATINGS):
        tell(n, len(GRATINGS), f"solving {grating} under a coat")
        for theta in ANGLES:
            for wavelength in FEW_WAVELENGTHS:
                rows = solve_one(grating, theta, wavelength)
                for series in SERIES:
                    by_series[series] = np.concatenate([by_series[series], rows[series]])
        for series in SERIES:
            save_rows(by_series[series], _about(series), folder / coated_file(series))
    tell(len(GRATINGS), len(GRATINGS), "done")
    return by_series


def solve_one(grating: Grating, theta: float, wavelength: float) -> dict[str, NDArray[np.void]]:
    """Rows of a grating in light of one direction (degrees) and wavelength (nm), by series."""
    orders, sines = order_sines(grating.period, wavelength, theta)
    inside = inner_orders(grating.period, wavelength, theta)
    outside = np.isin(inside, orders)
    first, final = (
        _matrices(grating, theta, wavelength, inside, fine=fine) for fine in (False, True)
    )
    cosine = np.sqrt(1 - sines**2)
    rows = {}
    for series in SERIES:
        part = np.zeros(len(orders), ROW)
        part["profile"] = PROFILES.index(grating.profile)
        part["period"], part["depth"] = grating.period, grating.depth
        part["theta"], part["wavelength"], part["order"] = theta, wavelength, orders
        for n, light in enumerate(("te", "tm")):
            face = np.abs(amplitudes(cosine, COAT)[n]) ** 2
            coarse, fine_ones = (
                leaving(matrix[n], face, outside, orders, series=series)
                for matrix in (first, final)
            )
            part[light], part[f"{light}_change"] = fine_ones, np.abs(fine_ones - coarse)
            part[f"{light}_balance"] = np.nan
        rows[series] = part
    return rows


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
    stored = {series: shipped_coated(series) for series in SERIES}
    compared = []
    for grating in gratings:
        for theta in ANGLES:
            single, bounced = (
                compare("aluminium", _of(part, grating, theta), "small_slope", COAT)
                for part in stored.values()
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


def shipped_coated(series: str) -> Solutions:
    """Stored solutions of one of `SERIES`."""
    with resources.as_file(resources.files(__package__) / "data" / coated_file(series)) as path:
        return load(path)


def _of(part: Solutions, grating: Grating, theta: float) -> Solutions:
    return part.where(
        profile=grating.profile, period=grating.period, depth=grating.depth, theta=theta
    )


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
    powers = np.stack([solution.orders[light][0] for light in ("te", "tm")], axis=1)
    yield from zip(orders.tolist(), powers, strict=True)


def _about(series: str) -> dict[str, object]:
    return {
        "command": "python -m docs.make.validation coated",
        "date": datetime.date.today().isoformat(),
        "solver": f"{rayleigh.name()}; lamellar and blazed: {integral.name()}",
        "material": f"aluminium under a coat of index {COAT:g}, {series}",
        "index": ", ".join(f"{n:g} at {w:g} nm" for w, n in ALUMINIUM.items()),
    }
