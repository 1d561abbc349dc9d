"""The Gaussian coherence window in frequency space, cut to a few taps (NumPy only).

Around every order j the table's sum has a Gaussian of the distance Δ in bins: exp(−s²Δ²) when
powers are added, exp(−s²Δ²/2) when amplitudes are, with s = σ·dq. A look-up reads the `taps` bins
nearest to the requested frequency in each direction; the omitted taps are an error to budget.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray

#: exp(−4.6²) = 6e-10: as good as all of the window.
FULL_REACH = 4.6

_MOST_TRIMMED = 64  # taps; more are read in a loop over whole rows


def first_tap(taps: int) -> int:
    """Offset of the first tap from floor(x) for even `taps`, from round(x) for odd ones."""
    return 1 - taps // 2 if taps % 2 == 0 else -(taps // 2)


def base_bin(x: NDArray[np.floating], taps: int) -> NDArray[np.floating]:
    """The bin that `first_tap` counts from, for positions x in bins."""
    return np.floor(x) if taps % 2 == 0 else np.floor(x + 0.5)


def taps_at(
    positions: NDArray[np.float64], last: int, taps: int
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Array index of the first tap (n,), and the distances in bins of all, (n, taps).

    Frequencies beyond the bins see the zeros at the margin, which is as wide as the taps.

    last : outermost bin; array index 0 is bin −last.
    """
    first = base_bin(positions, taps) + first_tap(taps)
    distance = positions[:, None] - (first[:, None] + np.arange(taps))
    return np.clip(first.astype(np.int64) + last, 0, 2 * last + 1 - taps), distance


def missing_power(step: float, taps: int) -> float:
    """Share of ∫exp(−s²Δ²) beyond `taps` bins in all, s = `step` = σ·dq."""
    return float(scipy.special.erfc(0.5 * step * taps))


def reach_error(steps: tuple[float, float], taps: tuple[int, int], coherent: bool) -> float:
    """Predicted relative L1 error of ⟨|P|²⟩ from leaving out all but the taps, both directions.

    Incoherent sums lose the left-out power itself. In a coherent sum the left-out amplitude δ, of
    that power, beats with the rest: |p + δ|² − |p|² has a mean size of at most 2|p||δ|.
    """
    missing = sum(missing_power(s, n) for s, n in zip(steps, taps, strict=True))
    return 2.0 * float(np.sqrt(missing)) if coherent else missing


def taps_for(steps: tuple[float, float], error: float, coherent: bool) -> tuple[int, int]:
    """Fewest taps (x, y) whose predicted error is at most `error`, half of it a direction."""

    def fewest(step: float) -> int:
        missing = (0.5 * error) ** 2 / 2 if coherent else error / 2
        reach = float(scipy.special.erfcinv(min(missing, 1.0)))
        return max(1, int(np.ceil(2.0 * reach / step)))

    return fewest(steps[0]), fewest(steps[1])


def trims_for(
    steps: tuple[float, float], taps: tuple[int, int], error: float, coherent: bool
) -> tuple[int, ...]:
    """Return how many taps at both ends of each row can be left out: the corners matter least.

    Parameters
    ----------
    steps, taps, coherent : as in `reach_error`.
    error : relative L1 error of ⟨|P|²⟩ that all taps left out may cause together.

    Returns
    -------
    One number a row; empty if none can be left out.
    """
    if taps[0] * taps[1] > _MOST_TRIMMED:
        return ()
    # each tap's share of ∫exp(−s²Δ²) along one direction, the mean over positions
    edges = (step * (np.arange(n + 1) - 0.5 * n) for step, n in zip(steps, taps, strict=True))
    shares = [0.5 * np.diff(scipy.special.erf(each)) for each in edges]
    spare = (0.5 * error) ** 2 if coherent else error
    spare -= sum(missing_power(step, count) for step, count in zip(steps, taps, strict=True))
    trims = [0] * taps[1]
    most = (taps[0] - 1) // 2
    # taps of the same share go together, so that the rest stays symmetric
    corners = [(shares[1][y] * shares[0][x], y, x) for y in range(taps[1]) for x in range(most)]
    for share, y, x in sorted(corners):
        same = 2.0 * share * (1 if 2 * y + 1 == taps[1] else 2)
        if y >= (taps[1] + 1) // 2 or x != trims[y]:
            continue
        if same > spare:
            break
        spare -= same
        trims[y] = trims[taps[1] - 1 - y] = x + 1
    return tuple(trims) if any(trims) else ()


def tap_matrix(
    positions: NDArray[np.float64],
    first_bin: int,
    bins: int,
    exponent: float,
    taps: int | None,
    chosen: Sequence[int] | None = None,
) -> scipy.sparse.csr_array:
    """Weights exp(−exponent·Δ²) from bins to positions, as a sparse (positions, bins) matrix.

    Parameters
    ----------
    positions : where to look up, in bins.
    first_bin, bins : the bin of column 0, and the number of columns.
    exponent : s² for powers, s²/2 for amplitudes.
    taps : how many bins around each position, or None for the full reach of the window.
    chosen : which of these taps, from 0; by default all.
    """
    if taps is None:
        reach = FULL_REACH * np.sqrt(2.0) / np.sqrt(exponent)  # enough for either exponent
        taps = 2 * int(np.ceil(reach)) + 2
    numbers = np.arange(taps) if chosen is None else np.asarray(chosen, int)
    columns = (base_bin(positions, taps) + first_tap(taps))[:, None] + numbers
    weights = np.exp(-exponent * (positions[:, None] - columns) ** 2)
    columns = columns.astype(int) - first_bin
    rows = np.broadcast_to(np.arange(len(positions))[:, None], columns.shape)
    inside = (columns >= 0) & (columns < bins)
    return scipy.sparse.csr_array(
        (weights[inside], (rows[inside], columns[inside])), shape=(len(positions), bins)
    )


def apply_window(matrices: Sequence[scipy.sparse.csr_array], bins: NDArray[Any]) -> NDArray[Any]:
    """Sum over the bins (ny, nx) with the weights of a matrix along x and one along y."""
    along_y = matrices[1] @ bins
    return (matrices[0] @ np.ascontiguousarray(along_y.T)).T
