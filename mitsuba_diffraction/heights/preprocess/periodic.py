"""Making a patch fit itself, since it tiles the plane: a step at the seams is a grating of its own.

References
----------
L. Moisan, Periodic plus smooth image decomposition, Journal of Mathematical Imaging and Vision 39,
161-179 (2011).
F. J. Harris, On the use of windows for harmonic analysis with the discrete Fourier transform,
Proceedings of the IEEE 66, 51-83 (1978): the Tukey (cosine-tapered) window.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..field import HeightField
from .edges import seam_share
from .treatment import Change, changed

FloatArray = npt.NDArray[np.float64]

# Width of the taper on each side, as a share of the patch: Tukey's α is twice this.
TAPER_SHARE = 0.1


def periodic_smooth(field: HeightField) -> tuple[HeightField, Change]:
    """Keep the periodic component of the heights and drop the smooth one (Moisan 2011).

    The smooth component s explains the steps at the seams and is as smooth as can be inside: its
    periodic Laplacian is v, the steps placed on the border pixels (Moisan's equation 11), so
    ŝ = v̂ / (Laplacian's eigenvalues), with mean 0. Differences along x and y are weighted by
    1/dx² and 1/dy², so that pixels need not be square.
    """
    h = field.heights
    ny, nx = field.shape
    wx, wy = _axis_weights(field)
    v = np.zeros_like(h)
    step_y = wy * (h[-1] - h[0])
    v[0] += step_y
    v[-1] -= step_y
    step_x = wx * (h[:, -1] - h[:, 0])
    v[:, 0] += step_x
    v[:, -1] -= step_x
    eigenvalues = _laplacian(ny, nx, wx, wy)
    eigenvalues[0, 0] = 1  # the mean, which v does not have
    spectrum = np.fft.rfft2(v) / eigenvalues
    spectrum[0, 0] = 0
    smooth = np.fft.irfft2(spectrum, s=(ny, nx))
    return _reported(field, h - smooth, "made periodic by dropping its smooth component")


def periodic_taper(field: HeightField) -> tuple[HeightField, Change]:
    """Let the heights fade to their mean along the borders with a Tukey window.

    A tenth of the patch on each side is faded; it turns flat there and so reflects more like a
    mirror.
    """
    mean = field.heights.mean()
    ny, nx = field.shape
    window = _tukey(ny)[:, None] * _tukey(nx)
    heights = mean + (field.heights - mean) * window
    return _reported(
        field, heights, f"tapered to its mean height over {TAPER_SHARE:.0%} along each border"
    )


def seam_step(field: HeightField) -> float:
    """RMS step of height across the seams, µm: last row to first row, last column to first."""
    h = field.heights
    steps = np.concatenate([h[0] - h[-1], h[:, 0] - h[:, -1]])
    return float(np.sqrt(np.mean(steps**2)))


def cross_share(field: HeightField) -> float:
    """Share of the mean-square slope, seams included, at frequencies with q_x or q_y near 0.

    Steps at the seams fill these axes of the spectrum evenly, the cross of a patch that does not
    fit itself: their heights' power falls as 1/q², which the slope's q² undoes. The frequencies
    next to the axes count as well: a step that varies along the seam, as on a levelled scan, is
    there. Isotropic roughness leaves about 3/nx + 3/ny in all of them, scan-line offsets more. A
    flat patch has 0.
    """
    ny, nx = field.shape
    wx, wy = _axis_weights(field)
    power = np.abs(np.fft.rfft2(field.heights)) ** 2
    power *= -_laplacian(ny, nx, wx, wy)
    # rfft2 holds one half of the spectrum: all columns but the first (and Nyquist's) count twice
    power[:, 1 : (nx + 1) // 2] *= 2
    total = float(power.sum())
    rows, columns = np.rint(np.fft.fftfreq(ny) * ny), np.arange(nx // 2 + 1)
    cross = (np.abs(rows)[:, None] <= 1) | (columns <= 1)
    return float(power[cross].sum()) / total if total > 0 else 0.0


def _reported(before: HeightField, heights: FloatArray, what: str) -> tuple[HeightField, Change]:
    after = HeightField(heights, before.pixel_size)
    figures = {
        "seam_before": seam_step(before),
        "seam_after": seam_step(after),
        "share_before": seam_share(before),
        "share_after": seam_share(after),
        "cross_before": cross_share(before),
        "cross_after": cross_share(after),
    }
    line = (
        f"{what}: RMS step at the seams {figures['seam_before']:.3g} -> "
        f"{figures['seam_after']:.3g} µm, {figures['share_before']:.2g} -> "
        f"{figures['share_after']:.2g} of the mean-square slope"
    )
    return changed(before, after.heights, line, **figures)


def _axis_weights(field: HeightField) -> tuple[float, float]:
    """Weights of squared differences along x and y; only their ratio matters."""
    dx, dy = field.pixel_size
    return dy / dx, dx / dy


def _laplacian(ny: int, nx: int, wx: float, wy: float) -> FloatArray:
    """Eigenvalues (ny, nx//2 + 1) of the periodic five-point Laplacian, in the layout of rfft2."""
    along_y = 2 * np.cos(2 * np.pi * np.fft.fftfreq(ny)) - 2
    along_x = 2 * np.cos(2 * np.pi * np.fft.rfftfreq(nx)) - 2
    result: FloatArray = wy * along_y[:, None] + wx * along_x
    return result


def _tukey(n: int) -> FloatArray:
    """Tukey window of n samples, symmetric about (n − 1)/2, near 0 at both ends."""
    distance = (np.minimum(np.arange(n), np.arange(n)[::-1]) + 0.5) / n  # to the border, share
    return 0.5 - 0.5 * np.cos(np.pi * np.minimum(distance / TAPER_SHARE, 1))
