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

from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mitsuba_diffraction.arrays import Real, Whole
from mitsuba_diffraction.reference.fresnel import amplitudes

from . import integral, rayleigh
from .cases import COAT, Case, Grating, Light, Media
from .compare import compare
from .models import ANGLES
from .solutions import Orders, Solutions, stored

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

#: As `index_of` knows it, at wavelengths in the coat.
_WITHIN = Media("aluminium under polycarbonate")
#: Media by the files of solutions, named without suffix: without what the face sends back to the
#: structure, and with it.
COATS = {
    f"aluminium_coated_{series}": Media("aluminium", coat=COAT, once=series == "single")
    for series in ("single", "bounced")
}


def name() -> str:
    """Names of the solvers."""
    return f"{rayleigh.name()}; lamellar and blazed: {integral.name()}"


def resolutions(case: Case) -> tuple[int, int]:
    """Coarse and fine."""
    return 0, 1


def solve(case: Case, fine: int) -> Orders:
    """Efficiencies of every order that leaves the coat."""
    assert isinstance(case.surface, Grating)
    orders = case.orders[:, 0]
    inside = inner_orders(case.surface.period, case.light.wavelength, case.light.theta)
    cosine = np.sqrt(1 - case.wo(case.orders)[:, 0] ** 2)
    faces = np.abs(amplitudes(cosine, COAT)) ** 2
    matrices = _matrices(case.surface, case.light, fine)
    outside, once = np.isin(inside, orders), case.media.once
    powers = [
        leaving(matrix, face, outside, orders, once=once)
        for matrix, face in zip(matrices, faces, strict=True)
    ]
    return Orders(case.orders, np.stack(powers, axis=1))


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


def inner_orders(period: float, wavelength: float, theta: float) -> Whole:
    """Orders that propagate inside the coat."""
    step, sine = wavelength / 1000 / period, np.sin(np.radians(theta))
    return np.arange(np.ceil((sine - COAT) / step), np.floor((sine + COAT) / step) + 1).astype(int)


class CoatDeviation(NamedTuple):
    """Deviation of colours of the default under a coat, for light from one angle.

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
    series = []
    for file, media in COATS.items():
        every = stored(file, media).solved
        solved = Solutions([s for s in every if s.case.surface in gratings])
        series.append(compare(solved, "small_slope"))
    compared = []
    for grating in gratings:
        for theta in ANGLES:
            parts = [each.where(grating=grating, theta=theta) for each in series]
            once, every = (float(p.rigorous[p.counted & p.coloured].sum()) for p in parts)
            values = (part.deviation(colours=True) for part in parts)
            compared.append(CoatDeviation(grating, theta, *values, 1 - once / every))
    return compared


@cache
def _matrices(grating: Grating, light: Light, fine: int) -> Real:
    """E of both polarisations, (2, inner, inner): from the column's order to the row's."""
    inside = inner_orders(grating.period, light.wavelength, light.theta)
    matrices = np.zeros((2, len(inside), len(inside)))
    for column, order in enumerate(inside):
        # going down in order m is light from −sin of it
        sine = np.sin(np.radians(light.theta)) - order * light.wavelength / 1000 / grating.period
        angle = float(np.degrees(np.arcsin(sine / COAT)))
        case = Case(grating, Light(light.wavelength / COAT, angle), _WITHIN)
        solver = rayleigh if grating.profile == "sinusoidal" else integral
        reflected = solver.solve(case, solver.resolutions(case)[fine])
        for relative, powers in zip(reflected.order[:, 0], reflected.powers, strict=True):
            row = np.flatnonzero(inside == order + relative)
            if len(row):
                matrices[:, row[0], column] = powers
    return matrices
