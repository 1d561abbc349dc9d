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
from numpy.typing import NDArray
from scipy.linalg import block_diag

from ...arrays import Complex, Real
from ...optics import fresnel
from .stations import Station

#: Share of the light that a totally reflecting side sends back: where a channel has no way out, as
#: in a flat sheet, the sum would not end.
_KEPT = 1.0 - 1e-7
#: Square of the sine below which light is taken as that along the normal.
_LEVEL = 1e-12


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
    c = np.sqrt(1.0 - y * y)
    flat = _FlatSide(c * station.sines_of(inside), y, index)
    back, out, into, mirror = (_products(jones) for jones in flat.jones)
    # channels of the outside are some of those within
    common = slice(-int(inside[0]), n - int(inside[0]))
    returned = np.einsum("xjb,jbc->xjc", side[within, within].reshape(-1, m, 4), back)
    system = np.eye(4 * m) - returned.reshape(-1, 4 * m)
    entered = block_diag(*into)[:, _rows(common, m)]
    came = np.hstack([side[within, above], side[within, within] @ entered])
    down = np.linalg.solve(system, came)
    up = block_diag(*back) @ down
    up[:, 4 * n :] += entered
    total = np.vstack([side[above, within] @ up, (block_diag(*out) @ down)[_rows(common, m)]])
    total[: 4 * n, : 4 * n] += side[above, above]
    total[4 * n :, 4 * n :] += block_diag(*mirror[common])
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


class _FlatSide:
    """Flat lower side of a sheet.

    x, y : tangential parts of the channels within, (n,), and of all; index : of the sheet.
    """

    def __init__(self, x: Real, y: float, index: float) -> None:
        sine = x**2 + y**2
        self._x, self._y, self._sine = x, y, sine
        within, outside = index**2 - sine, 1.0 - sine
        lit, leaves = within > 0.0, outside > 0.0
        z_within = np.sqrt(np.where(lit, within, 1.0))
        z_outside = np.sqrt(np.where(leaves, outside, 1.0))
        cosine = z_within / index
        face = fresnel.amplitudes(cosine, 1.0 - cosine * cosine, 1.0 / index)
        r = np.stack(face, axis=-1).astype(np.complex128) * lit[:, None]
        t = np.sqrt(np.maximum(1.0 - np.abs(r) ** 2, 0.0)) * (lit & leaves)[:, None]
        down, up = (self._turn(sign * z_within, index) for sign in (-1.0, 1.0))
        below, rising = (self._turn(sign * z_outside, 1.0) for sign in (-1.0, 1.0))

        def joined(left: Real, values: Complex, came: Real) -> Complex:
            return np.einsum("nsa,ns,nsc->nac", left, values, came)

        #: Jones matrices (n, 2, 2) from within back and out, and from below in and back.
        self.jones = (
            joined(up, _KEPT * r, down),
            joined(below, t, down),
            joined(up, t, rising),
            joined(below, -r * leaves[:, None], rising),
        )

    def _turn(self, z: Real, index: float) -> Real:
        """Return the matrices (n, 2, 2) from E and B along the grooves to E and B along s.

        In the axes along x, up and the grooves, a wave (x, z, y) of index n whose E lies along the
        grooves has E along G − y(x, z, y)/n², and one whose B does has E along (−z, x, 0). s is
        along (y, 0, −x).
        """
        level = self._sine < _LEVEL
        length = np.sqrt(np.where(level, 1.0, self._sine) * (index**2 - self._y**2))
        cos = np.where(level, 1.0, -self._x * index / length)
        sin = np.where(level, 0.0, -self._y * z / length)
        return np.stack([np.stack([cos, sin], -1), np.stack([-sin, cos], -1)], axis=-2)


def _products(jones: Complex) -> Complex:
    """Return the matrices (n, 4, 4) that take products of components, of Jones matrices."""
    return np.einsum("nac,nbd->nabcd", jones, jones.conj()).reshape(len(jones), 4, 4)


def _rows(channels: slice, count: int) -> NDArray[np.int64]:
    """Return the rows of the products of some of `count` channels."""
    return np.asarray(np.arange(4 * count).reshape(-1, 4)[channels].ravel())
