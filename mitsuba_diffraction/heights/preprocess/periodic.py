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
from .levelling import rms_change

FloatArray = npt.NDArray[np.float64]

# Width of the taper on each side, as a share of the patch: Tukey's α is twice this.
TAPER_SHARE = 0.1


def periodic_smooth(field: HeightField) -> HeightField:
    """Keep the periodic component of the heights and drop the smooth one (Moisan 2011).

    The smooth component s explains the steps at the seams and is as smooth as can be inside: its
    periodic Laplacian is v, the steps placed on the border pixels (Moisan's equation 11), so
    ŝ = v̂ / (Laplacian's eigenvalues), with mean 0. Differences along x and y are weighted by
    1/dx² and 1/dy², so that pixels need not be square.
    """
    h = field.heights
    ny, nx = field.shape
    dx, dy = field.pixel_size
    wx, wy = dy / dx, dx / dy  # only their ratio matters
    v = np.zeros_like(h)
    step_y = wy * (h[-1] - h[0])
    v[0] += step_y
    v[-1] -= step_y
    step_x = wx * (h[:, -1] - h[:, 0])
    v[:, 0] += step_x
    v[:, -1] -= step_x
    along_y = 2 * np.cos(2 * np.pi * np.fft.fftfreq(ny)) - 2
    along_x = 2 * np.cos(2 * np.pi * np.fft.rfftfreq(nx)) - 2
    eigenvalues = wy * along_y[:, None] + wx * along_x
    eigenvalues[0, 0] = 1  # the mean, which v does not have
    spectrum = np.fft.rfft2(v) / eigenvalues
    spectrum[0, 0] = 0
    smooth = np.fft.irfft2(spectrum, s=(ny, nx))
    return _reported(field, h - smooth, "made periodic by dropping its smooth component")


def periodic_taper(field: HeightField) -> HeightField:
    """Let the heights fade to their mean along the borders with a Tukey window.

    A tenth of the patch on each side is faded; it turns flat there and so reflects more like a
    mirror.
    """
    from scipy.signal.windows import tukey  # half of what importing the package would take

    mean = field.heights.mean()
    # every other sample of a window of 2n + 1: taken at the pixels' centres, near 0 at both ends
    rows, columns = (tukey(2 * n + 1, 2 * TAPER_SHARE)[1::2] for n in field.shape)
    window = rows[:, None] * columns
    heights = mean + (field.heights - mean) * window
    return _reported(
        field, heights, f"tapered to its mean height over {TAPER_SHARE:.0%} along each border"
    )


def seam_step(field: HeightField) -> float:
    """RMS step of height across the seams, µm: last row to first row, last column to first."""
    h = field.heights
    steps = np.concatenate([h[0] - h[-1], h[:, 0] - h[:, -1]])
    return float(np.sqrt(np.mean(steps**2)))


def _reported(field: HeightField, heights: FloatArray, what: str) -> HeightField:
    after = HeightField(heights, field.pixel_size)
    line = (
        f"{what}: RMS step at the seams {seam_step(field):.3g} -> {seam_step(after):.3g} µm, "
        f"{seam_share(field):.2g} -> {seam_share(after):.2g} of the mean-square slope"
    )
    return field.changed(after.heights, line + rms_change(field, heights))
