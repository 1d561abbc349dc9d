"""Rigorous solutions of coated gratings: orders that go back and forth between coat and structure.

Under a clear coat of index n, thick and uneven enough that powers add up, the orders inside are the
channels between which a solver of the package has all amplitudes: E[l, m] is the share of light
coming down in order m that goes up in order l. The face transmits the share T_m of this light and
sends R_m back, which is 1 beyond the critical angle. With light T_0 coming in, the powers p that go
up are

    p = E (e_0 T_0 + R p) = (1 − E R)⁻¹ E e_0 T_0,   and T p leaves; R_0 of order 0 never came in.

In the plane across the grooves s and p light stay apart, and this is exact for each.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.arrays import Real, Whole
from mitsuba_diffraction.orders.solve import Chandezon, IntegralSolver
from mitsuba_diffraction.reference.fresnel import amplitudes

from .cases import COAT, Case, Grating, Light, Media, index_of
from .compare import Comparison, compare
from .light import light_of, profile_of
from .solutions import Orders, stored, version

#: Profiles that are solved: sinusoids, and edges.
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

#: Media by the files of solutions, named without suffix: without what the face sends back to the
#: structure, and with it.
COATS = {
    f"aluminium_coated_{series}": Media("aluminium", coat=COAT, once=series == "single")
    for series in ("single", "bounced")
}


def name() -> str:
    """Names of the solvers."""
    return f"Chandezon's method; lamellar: gratinglab {version('gratinglab')}, integral method"


def resolutions(case: Case) -> tuple[int, int]:
    """Harmonics on either side, or points on the boundary: first and finally."""
    return (400, 560) if case.has(profile="lamellar") else (24, 32)


def solve(case: Case, resolution: int) -> Orders:
    """Efficiencies of every order that leaves the coat."""
    assert isinstance(case.surface, Grating)
    orders = case.orders[:, 0]
    inside, matrices = _matrices(case.surface, case.light, resolution)
    cosine = np.sqrt(1 - case.wo(case.orders)[:, 0] ** 2)
    faces = np.abs(amplitudes(cosine, COAT)) ** 2
    outside, once = np.isin(inside, orders), case.media.once
    powers = [
        leaving(matrix, face, outside, orders, once=once)
        for matrix, face in zip(matrices, faces, strict=True)
    ]
    return Orders(case.orders, np.stack(powers, axis=1))


@cache
def _matrices(grating: Grating, light: Light, resolution: int) -> tuple[Whole, Real]:
    """Orders inside the coat, and E of both polarisations, (2, inner, inner).

    E is from the column's order to the row's.
    """
    wavelength = light.wavelength / COAT
    index = index_of("aluminium under polycarbonate", wavelength)
    x = -np.sin(np.radians(light.theta)) / COAT
    station, mirror = light_of(grating.period, 1e-3 * wavelength, index, x, 0.0)
    method = IntegralSolver if grating.profile == "lamellar" else Chandezon
    between = method(profile_of(grating), resolution).amplitudes(station)[0]
    powers = (np.abs(between) ** 2).sum(axis=-1)
    # channels are numbered towards lower orders
    return mirror - np.arange(station.channels)[::-1], powers[::-1, :, ::-1].transpose(1, 2, 0)


def leaving(
    matrix: Real, face: Real, outside: NDArray[np.bool_], orders: Whole, *, once: bool
) -> Real:
    """Efficiencies of the orders that leave the coat, from E (inner, inner) and R of the face.

    face : (orders,) of those that leave; outside : which of the inner orders these are.
    """
    back = np.ones(len(matrix))  # beyond the critical angle
    back[outside] = face
    zeroth = np.flatnonzero(outside)[orders == 0][0]
    came = matrix[:, zeroth] * (1.0 - back[zeroth])
    up = came if once else np.linalg.solve(np.eye(len(matrix)) - matrix * back, came)
    out = ((1.0 - back) * up)[outside]
    out[orders == 0] += face[orders == 0]
    return np.asarray(out)


def compared(gratings: Sequence[Grating] = GRATINGS) -> list[Comparison]:
    """Compare the default with the stored solutions of gratings, by `COATS`."""
    solved = (stored(*each).where(surface=list(gratings)) for each in COATS.items())
    return [compare(solutions, "small_slope") for solutions in solved]


def returned(once: Comparison, bounced: Comparison) -> float:
    """Part of the rigorous colours that the coat's face has sent back at least once."""
    single, every = (part.rigorous[part.counted & part.coloured].sum() for part in (once, bounced))
    return float(1 - single / every)
