"""Efficiencies of a thin sheet: its structured upper side, and its flat lower side.

The sheet is too thick for light from its two sides to interfere, as in `optics.through`. Light
of a channel adds up in powers, then, with the polarisation that it has: two components E and B of
one wave keep their phase. Their products E_a E_b* (Born and Wolf, section 10.9), four numbers for
each channel, go down and up between the sides. With light a from above and b from below,

    d = T a + R (F d + C b),   above: R₀ a + U (F d + C b),   below: B d + G b,

where d is the light that reaches the flat side, R₀, T, R, U are the structured side's (from above
back and down, from within back and up), and F, B (from within back and out), G, C (from below back
and in) are Fresnel's, one channel for itself. Channels that are totally reflected at the flat side
leave through the structured one.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import block_diag

from ...arrays import Complex, Real
from .coupled import Inner, scattered
from .stations import Station

#: Share of the light that a totally reflecting side sends back: where a channel has no way out, as
#: in a flat sheet, the sum would not end.
_KEPT = 1.0 - 1e-7


def sheet_efficiencies(amplitudes: Complex, station: Station) -> Real:
    """Return the efficiencies of a sheet from the amplitudes of its structured side.

    Parameters
    ----------
    amplitudes : (wavelengths, ports, 2, ports, 2) of `Solver.amplitudes`.
    station : thin, of a real index.

    Returns
    -------
    (wavelengths, ports, 2, ports, 2) : share of the incident light, with the ports of `cells`.
    """
    assert station.indices is not None
    each = zip(amplitudes, station.indices.real, station.along, strict=True)
    return np.stack([_efficiencies(values, station, *rest) for values, *rest in each])


def _efficiencies(amplitudes: Complex, station: Station, index: float, y: float) -> Real:
    """Return the efficiencies (ports, 2, ports, 2) at one wavelength."""
    n, inside = station.channels, station.inside
    side = _structured(amplitudes, n)
    m = len(inside)
    above, within = slice(0, 4 * n), slice(4 * n, None)
    # channels of the outside are some of those within
    common = slice(-int(inside[0]), n - int(inside[0]))
    # the flat side mirrored, with the outside above: E along d × e changes its sign
    waves = np.sqrt(1.0 - y * y) * station.sines_of(inside), np.full(m, y)
    within_it = Inner(np.arange(m), index, 0.0)
    flat = scattered(waves, (), index**2, np.arange(m)[common], 0.0, within_it)
    flat = flat.transpose(0, 2, 3, 1) * np.array([[1.0, -1.0], [-1.0, 1.0]])
    low, high = np.arange(n, n + m), np.arange(n)
    back, mirror = _products(_KEPT * flat[low, low]), _products(flat[high, high])
    out, into = _products(flat[low[common], high]), _products(flat[high, low[common]])
    returned = np.einsum("xjb,jbc->xjc", side[within, within].reshape(-1, m, 4), back)
    system = np.eye(4 * m) - returned.reshape(-1, 4 * m)
    shared = np.arange(4 * m).reshape(m, 4)[common].ravel()
    entered = np.zeros((4 * m, 4 * n), complex)
    entered[shared] = block_diag(*into)
    came = np.hstack([side[within, above], side[within, within] @ entered])
    down = np.linalg.solve(system, came)
    up = block_diag(*back) @ down
    up[:, 4 * n :] += entered
    total = np.vstack([side[above, within] @ up, block_diag(*out) @ down[shared]])
    total[: 4 * n, : 4 * n] += side[above, above]
    total[4 * n :, 4 * n :] += block_diag(*mirror)
    # |E|² and |B|² of all products; (out, in) to (in, out)
    powers = total.reshape(2 * n, 4, 2 * n, 4)[:, ::3][..., ::3].real
    return np.asarray(np.maximum(powers, 0.0).transpose(2, 3, 0, 1))


def _structured(amplitudes: Complex, channels: int) -> Complex:
    """Return the products (4 ports out, 4 ports in) of the structured side.

    Light from within adds up over many reflections. It must neither grow nor fade by the solver's
    error, which is largest where it stays within: R becomes the nearest matrix that conserves
    energy with U, W √(1 − U†U) with a unitary W (Higham 2008, "Functions of matrices", section 8).
    """
    ports, n = len(amplitudes), 2 * channels
    matrix = amplitudes.transpose(2, 3, 0, 1).reshape(2 * ports, 2 * ports).copy()
    lit = n + np.flatnonzero(np.abs(matrix[n:, n:]).any(axis=0))
    inner = np.ix_(lit, lit)
    up = matrix[:n, lit]
    squares, vectors = np.linalg.eigh(np.eye(len(lit)) - up.conj().T @ up)
    root = (vectors * np.sqrt(np.maximum(squares, 0.0))) @ vectors.conj().T
    left, _, right = np.linalg.svd(matrix[inner] @ root)
    matrix[inner] = left @ right @ root
    jones = matrix.reshape(ports, 2, ports, 2)
    products = np.einsum("qajc,qbjd->qabjcd", jones, jones.conj(), optimize=True)
    return np.asarray(products.reshape(4 * jones.shape[0], -1))


def _products(jones: Complex) -> Complex:
    """Return the matrices (n, 4, 4) that take products of components, of Jones matrices."""
    return np.einsum("nac,nbd->nabcd", jones, jones.conj()).reshape(len(jones), 4, 4)
