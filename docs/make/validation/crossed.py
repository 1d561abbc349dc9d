"""Rigorous solutions in two dimensions by coupled waves in layers: `grcwa` (extra `validation`).

Liu and Fan 2012 ("S4", Computer Physics Communications 183, 2233). It gives complex amplitudes of
both polarisations at any incidence. Two things are ours: in a layer through a slope, ε is the mean
over the layer's height along the surface, and the harmonic mean across, so that the error goes with
the square of the layers' thickness; and the harmonics are those nearest to the normal of the
*light's* frequencies, so that oblique light needs no more of them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mitsuba_diffraction import HeightField
from mitsuba_diffraction.arrays import Complex, Real, Whole
from mitsuba_diffraction.reference import boundary

from .cases import Case
from .solutions import Orders, imported, version

#: Orders closer to the horizon than this cosine are not returned.
HORIZON = 0.01
# modes whose |Im q| is below this share of |Re q| travel: the rest is rounding
_TRAVELLING = 1e-6


def name() -> str:
    """The solver's name and version."""
    return f"grcwa {version('grcwa')}, coupled waves"


def resolutions(case: Case) -> tuple[tuple[int, int], ...]:
    """Numbers of spatial frequencies that the field is expanded in, and layers of the heights."""
    return ((101, 8), (165, 14)) if is_crossed(case.field) else ((41, 12), (61, 24))


def solve(case: Case, resolution: tuple[int, int]) -> Orders:
    """Amplitudes of every reflected order.

    Parameters
    ----------
    case : where all rows of the heights are the same, a grating along x.
    resolution : as `resolutions`.

    Raises
    ------
    DiffractionError
        If grcwa is not installed.
    """
    grcwa = imported("grcwa")
    (harmonics, layers), field, lam = resolution, case.field, case.light.wavelength / 1000
    assert case.index is not None
    width, height = field.extent
    # grcwa's z points along the light: its frame is ours turned about x by half a turn
    along = -case.wi * _TURNED
    chosen = lowest_orders(along, lam, (width, height), is_crossed(field), harmonics)
    grcwa.rcwa.SolveLayerEigensystem = _eigenmodes
    grcwa.rcwa.Lattice_getG = lambda *_, **__: (chosen, len(chosen))
    polar, azimuth = np.arccos(along[2]), np.arctan2(along[1], along[0])
    cell = grcwa.obj(harmonics, [width, 0], [0, height], 1 / lam, polar, azimuth, verbose=0)
    _stack(cell, field, case.index**2, layers)
    return _amplitudes(cell, chosen, case, float(field.heights.max()))


def is_crossed(field: HeightField) -> bool:
    """Whether the heights change along y too."""
    return bool(np.any(field.heights != field.heights[0]))


#: From our frame to grcwa's and back.
_TURNED = np.array([1.0, -1.0, -1.0])


def lowest_orders(
    along: Real,
    lam: float,
    extent: tuple[float, float],
    crossed: bool,
    count: int,
) -> Whole:
    """Order numbers (count, 2) of the lowest spatial frequencies of the field, light's included."""
    reach = np.arange(-count, count + 1) if not crossed else np.arange(-40, 41)
    mx, my = np.meshgrid(reach, reach if crossed else [0], indexing="ij")
    orders = np.stack([mx.ravel(), my.ravel()], axis=1)
    frequency = along[:2] / lam + orders / np.array(extent)
    return orders[np.argsort(np.hypot(*frequency.T), kind="stable")[:count]]


def _stack(cell: Any, field: HeightField, epsilon: complex, layers: int) -> None:
    """Vacuum, layers through the heights, and the material."""
    ny, nx = field.shape
    heights = field.heights[-np.arange(ny) % ny, :].T  # grcwa's y points the other way
    top, thickness = heights.max(), np.ptp(heights) / layers
    cell.Add_LayerUniform(0.0, 1.0)
    for _ in range(layers):
        cell.Add_LayerGrid(thickness, nx, ny)
    cell.Add_LayerUniform(0.0, epsilon)
    cell.Init_Setup()
    bottoms = top - thickness * np.arange(1, layers + 1)
    filled = np.clip((heights - bottoms[:, None, None]) / thickness, 0, 1).ravel()
    mean = 1 + filled * (epsilon - 1)
    cell.GridLayer_geteps([mean, mean, 1 / (1 - filled + filled / epsilon)])


def _amplitudes(cell: Any, orders: Whole, case: Case, top: float) -> Orders:
    """Reflected fields of light polarised along s and p, from the stack's scattering matrix."""
    from grcwa.rcwa import GetSMatrix

    wi, omega, count = case.wi, cell.omega.real, cell.nG
    kx, ky = np.real(cell.kx), np.real(cell.ky)
    up = np.sqrt(np.maximum(omega**2 - kx**2 - ky**2, 0)) / omega
    propagating = up > HORIZON
    wo = np.stack([kx / omega, -ky / omega, up], axis=1)[propagating]
    s_in, s_out = boundary.polarisation_axes(wi, wo)
    p_out = np.cross(wo, s_out)
    layers = len(cell.thickness_list)
    lists = cell.q_list, cell.phi_list, cell.kp_list, cell.thickness_list
    reflection = GetSMatrix(0, layers - 1, *lists)[2]
    zeroth = int(np.flatnonzero((orders == 0).all(axis=1))[0])
    fields = []
    basis = boundary.polarisation_axes(wi, wi * [-1, -1, 1])[0]
    for electric in (basis, np.cross(-wi, basis)):
        magnetic = np.cross(-wi * _TURNED, electric * _TURNED)
        incident = np.zeros(2 * count, complex)
        incident[[zeroth, count + zeroth]] = magnetic[:2]
        outgoing = -(reflection @ incident) / omega / cell.q_list[0]
        # grcwa has (−Ey, Ex), and its y points the other way
        y, x = (half[propagating] for half in np.split(cell.kp_list[0] @ outgoing, 2))
        z = -(wo[:, 0] * x + wo[:, 1] * y) / wo[:, 2]
        out = np.stack([x, y, z], axis=1)
        fields.append([np.sum(out * s_out, axis=1), np.sum(out * p_out, axis=1)])
    jones = np.moveaxis(np.array(fields), 2, 0).swapaxes(1, 2)
    # from the zeroth order's axes to those that `boundary` has for each pair of directions
    turned = jones @ boundary.turn(basis, s_in, -wi)
    # the solver's phases are those at the highest point
    phase = np.exp(-1j * omega * (wi[2] + wo[:, 2]) * top)
    order = orders[propagating] * [1, -1]
    return Orders.of_amplitudes(case, order, phase[:, None, None] * turned)


def _eigenmodes(omega: Any, kx: Any, ky: Any, kp: Any, epsilon: Any) -> tuple[Complex, Complex]:
    """Modes of a layer; grcwa's own takes a travelling mode whose Im q is −1e-17 for a returning
    one, which makes its scattering matrices singular."""
    k = np.vstack((np.diag(kx), np.diag(ky)))
    squared, modes = np.linalg.eig(epsilon @ kp - k @ k.T)
    q = np.sqrt(squared)
    travels = np.abs(q.imag) < _TRAVELLING * np.abs(q.real)
    return np.where(np.where(travels, q.real < 0, q.imag < 0), -q, q), modes
