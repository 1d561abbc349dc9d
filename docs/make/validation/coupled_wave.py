"""A second rigorous solver: coupled waves in layers, by `pySCATMECH` (extra `validation`).

Moharam and Gaylord's method with Li's factorisation, on layers of a staircase. It converges for a
dielectric of any profile, and in a metal for TE and where the profile has no staircase (lamellar);
for TM on a metallic staircase it does not, so that is not asked of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from mitsuba_diffraction.streams import own_program, without_chatter

from .cases import Scan, index_of, order_sines
from .solutions import Efficiencies, imported, version

#: (highest Fourier order, layers of the staircase): first and finally.
STAIRCASE = ((12, 40), (24, 80))
#: One layer is enough for a lamellar grating, whose sharp edges in a metal take many orders.
LAMELLAR = ((60, 1), (120, 1))


def name() -> str:
    """The solver's name and version."""
    return f"pySCATMECH {version('pySCATMECH')}, coupled waves"


def can_solve(scan: Scan, polarisation: str) -> bool:
    """Whether coupled waves converge for this ("te" or "tm")."""
    if scan.material == "keratin":
        return True
    staircase = scan.grating.profile != "lamellar"
    return scan.material == "aluminium" and (polarisation == "te" or not staircase)


def part_of(scans: Sequence[Scan]) -> list[Scan]:
    """The scans to compare both solvers with: shallow and deep, narrow and wide, one wavelength."""
    return [
        replace(scan, wavelengths=scan.wavelengths[-1:])
        for scan in scans
        if scan.grating.period in (1.1, 2.5) and scan.grating.depth in (0.1, 0.4)
    ]


def resolutions(scan: Scan) -> tuple[tuple[int, int], tuple[int, int]]:
    """Resolutions to solve with, first and finally."""
    return LAMELLAR if scan.grating.profile == "lamellar" else STAIRCASE


def solve(scan: Scan, resolution: tuple[int, int]) -> Efficiencies:
    """Efficiencies of every order at each wavelength of a scan, by polarisation; NaN where
    coupled waves do not converge.

    Parameters
    ----------
    scan : of a material with an index.
    resolution : of `resolutions`: highest Fourier order, and layers.

    Raises
    ------
    DiffractionError
        If pySCATMECH is not installed.
    """
    model_of = imported("pySCATMECH.rcw").RCW_Model
    result = Efficiencies(len(scan.wavelengths))
    for wavelength in scan.wavelengths:
        orders, _ = order_sines(scan.grating.period, wavelength, scan.theta)
        with own_program(), without_chatter():  # it reports every layer
            model = model_of(_parameters(scan, wavelength, resolution))
            matrices = np.array([np.array(model.DiffractionEfficiency(int(m))) for m in orders])
        # Mueller matrices: with grooves across the plane of incidence, s is TE
        for polarisation, sign in (("te", 1), ("tm", -1)):
            values = matrices[:, 0, 0] + sign * matrices[:, 0, 1]
            usable = can_solve(scan, polarisation)
            result.orders[polarisation].append(values if usable else np.full(len(orders), np.nan))
    return result


def _parameters(scan: Scan, wavelength: float, resolution: tuple[int, int]) -> dict[str, object]:
    index = index_of(scan.material, wavelength)
    material = f"({index.real:.12g},{index.imag:.12g})"
    grating, (order, layers) = scan.grating, resolution
    common: dict[str, object] = {
        "order": order,
        "type": 0,  # reflection
        "lambda": wavelength / 1000,
        "thetai": scan.theta,
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
