"""A second rigorous solver: coupled waves in layers, by `pySCATMECH` (extra `validation`).

Moharam and Gaylord's method with Li's factorisation, on layers of a staircase. It converges for a
dielectric of any profile, and in a metal for TE and where the profile has no staircase (lamellar);
for TM on a metallic staircase it does not, so that is not asked of it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mitsuba_diffraction.streams import own_program, without_chatter

from .cases import FEW_WAVELENGTHS, Case, Grating
from .solutions import LIGHTS, Orders, imported, version

#: (highest Fourier order, layers of the staircase): first and finally.
STAIRCASE = ((12, 40), (24, 80))
#: One layer is enough for a lamellar grating, whose sharp edges in a metal take many orders.
LAMELLAR = ((60, 1), (120, 1))


def name() -> str:
    """The solver's name and version."""
    return f"pySCATMECH {version('pySCATMECH')}, coupled waves"


def can_solve(case: Case, polarisation: str) -> bool:
    """Whether coupled waves converge for this ("te" or "tm")."""
    if case.media.material == "keratin":
        return True
    staircase = not case.has(profile="lamellar")
    return case.media.material == "aluminium" and (polarisation == "te" or not staircase)


def part_of(cases: Sequence[Case]) -> list[Case]:
    """The cases to compare both solvers with: shallow and deep, narrow and wide, one wavelength."""
    return [
        case
        for case in cases
        if case.has(wavelength=FEW_WAVELENGTHS[-1], period=[1.1, 2.5], depth=[0.1, 0.4])
    ]


def resolutions(case: Case) -> tuple[tuple[int, int], tuple[int, int]]:
    """Resolutions to solve with, first and finally."""
    return LAMELLAR if case.has(profile="lamellar") else STAIRCASE


def solve(case: Case, resolution: tuple[int, int]) -> Orders:
    """Efficiencies of every order of a grating in light across the grooves.

    Parameters
    ----------
    case : of a material with an index.
    resolution : of `resolutions`: highest Fourier order, and layers.

    Raises
    ------
    DiffractionError
        If pySCATMECH is not installed.
    """
    model_of = imported("pySCATMECH.rcw").RCW_Model
    with own_program(), without_chatter():  # it reports every layer
        model = model_of(_parameters(case, resolution))
        matrices = np.array(
            [np.array(model.DiffractionEfficiency(int(m))) for m in case.orders[:, 0]]
        )
    # Mueller matrices: with grooves across the plane of incidence, s is TE
    powers = np.stack([matrices[:, 0, 0] + sign * matrices[:, 0, 1] for sign in (1, -1)], axis=1)
    usable = [can_solve(case, polarisation) for polarisation in LIGHTS]
    return Orders(case.orders, np.where(usable, powers, np.nan))


def _parameters(case: Case, resolution: tuple[int, int]) -> dict[str, object]:
    index, grating, (order, layers) = case.index, case.surface, resolution
    assert isinstance(grating, Grating)
    assert index is not None
    material = f"({index.real:.12g},{index.imag:.12g})"
    common: dict[str, object] = {
        "order": order,
        "type": 0,  # reflection
        "lambda": case.light.wavelength / 1000,
        "thetai": case.light.theta,
        "grating": _KINDS[grating.profile],
        "grating.period": grating.period,
        "grating.medium_i": "(1,0)",
        "grating.medium_t": material,
        "grating.material": material,
    }
    if grating.profile == "lamellar":
        width = 0.5 * grating.period
        return common | {
            "grating.height": grating.depth,
            "grating.topwidth": width,
            "grating.bottomwidth": width,
            "grating.nlevels": layers,
            "grating.space": "(1,0)",
        }
    shape: dict[str, object] = {"grating.amplitude": grating.depth, "grating.nlevels": layers}
    if grating.profile == "blazed":
        # its x points away from the light's side: what descends there ascends here
        shape["grating.aspect"] = 0.0
    return common | shape


_KINDS = {
    "sinusoidal": "Sinusoidal_Relief_Grating",
    "lamellar": "Single_Line_Grating",
    "blazed": "Triangular_Grating",
}
