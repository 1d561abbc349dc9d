"""Filling points that an instrument could not measure."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from scipy import ndimage, sparse
from scipy.sparse import linalg

from ...errors import DiffractionError

FloatArray = npt.NDArray[np.float64]

METHODS = ("nearest", "harmonic")

# Above this share the filling, not the sample, would decide the picture.
LARGEST_SHARE = 0.5


def fill_missing(heights: FloatArray, method: str | None, name: str) -> tuple[FloatArray, str]:
    """Replace NaN by heights made from the points around.

    Parameters
    ----------
    heights
        Shape (ny, nx); points without data are NaN.
    method
        "nearest": the height of a nearest measured point. "harmonic": the membrane spanned over
        each gap, ∇²h = 0 with the measured border and free edges of the patch. `None` refuses.
    name
        What to call the patch in errors.

    Returns
    -------
    FloatArray, str
        The filled heights, and a line that says how many points were filled; "" if none were.

    Raises
    ------
    DiffractionError
        If points are missing and `method` is `None`, or more than half of them are.
    """
    missing = np.isnan(heights)
    count = int(np.count_nonzero(missing))
    if count == 0 or np.isinf(heights).any():  # which HeightField refuses, and no gap continues
        return heights, ""
    share = f"{count} of {heights.size} points ({count / heights.size:.2g} of all)"
    if count == heights.size:
        raise DiffractionError(f"{name}: no height is a finite number; the patch is empty")
    if method is None:
        raise DiffractionError(
            f"{name}: {share} have no height (NaN or masked); choose how to fill them with fill, "
            f"one of {', '.join(METHODS)}, or keep the middle without them with crop"
        )
    if count > LARGEST_SHARE * heights.size:
        raise DiffractionError(f"{name}: {share} have no height, too many to fill; crop the patch")
    filled = _nearest(heights, missing)
    if method == "harmonic":
        filled = _harmonic(filled, missing)
    return filled, f"{share} had no height and were filled, method {method}"


def _nearest(heights: FloatArray, missing: npt.NDArray[np.bool_]) -> FloatArray:
    """Height of the nearest measured point, by the exact Euclidean distance transform."""
    rows, columns = ndimage.distance_transform_edt(
        missing, return_distances=False, return_indices=True
    )
    filled: FloatArray = heights[rows, columns]
    return filled


def _harmonic(start: FloatArray, missing: npt.NDArray[np.bool_]) -> FloatArray:
    """Solve Laplace's equation on the missing points by conjugate gradients, from `start`.

    The five-point Laplacian with free edges is symmetric and, with a measured point anywhere,
    positive definite; iterations grow with the width of the gaps, not with their number.
    """
    rows, columns = np.nonzero(missing)
    ny, nx = missing.shape
    count = rows.size
    index = np.full(missing.shape, -1)
    index[missing] = np.arange(count)
    degree, measured = np.zeros(count), np.zeros(count)
    links = []  # pairs of neighbouring missing points
    for down, right in ((-1, 0), (1, 0), (0, -1), (0, 1)):
        r, c = rows + down, columns + right
        inside = np.nonzero((r >= 0) & (r < ny) & (c >= 0) & (c < nx))[0]
        degree[inside] += 1
        r, c = r[inside], c[inside]
        known = ~missing[r, c]
        measured[inside[known]] += start[r[known], c[known]]
        links.append((inside[~known], index[r[~known], c[~known]]))
    at, neighbour = (np.concatenate(ends) for ends in zip(*links, strict=True))
    adjacency = sparse.coo_array((np.ones(at.size), (at, neighbour)), shape=(count, count))
    laplacian = (sparse.diags_array(degree) - adjacency).tocsr()
    if not np.any(laplacian @ start[missing] - measured):
        return start  # solved, which conjugate gradients divide by
    # Heights come as float32 at best, 1e-7 of their size; solving far below that gains nothing.
    solution, failed = linalg.cg(
        laplacian, measured, x0=start[missing], rtol=1e-9, maxiter=10 * (ny + nx)
    )
    if failed:
        raise DiffractionError("fill: the gaps are too wide for 'harmonic'; use 'nearest'")
    filled = start.copy()
    filled[missing] = solution
    return filled
