"""R + T amid the nodes of a scale, and the scale lowered where that is above 1 (NumPy only).

Between directions and wavelengths of the scale an order may appear or vanish. So the sums are
looked at amid them too: what was too much is taken from the nodes around.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from .chains import put
from .conservation import largest_around, of_both_pages
from .grating import NODES
from .sheet import ChainSides
from .sums import LinkedSums, Sums

Array = NDArray[np.float32]
#: By what factor each cell is too bright, (2, rows, columns), of the scales' pages (2 or 4, …).
Excess = Callable[[Array], Array]

#: What R + T is brought below; how often by the root of what is too much, before by all of it; and
#: by how much at most at a time.
CEILING, GENTLE, MOST = 0.9995, 2, 1.5
#: And up to which polar angle of a `DirectionGrid`, rad.
LOOKED_AT = float(np.radians(80.0))


def lowered(values: Array, excesses: Sequence[Excess]) -> Array:
    """Scales (2 or 4, wavelengths, rows, columns): c of both sides, and s, which is lowered then.

    excesses : amid each two of the wavelengths, or at the one.
    """
    values, pages = values.copy(), values.shape[1]
    for turn in range(GENTLE + 1):
        much = np.stack(
            [
                excess(0.5 * (values[:, n] + values[:, min(n + 1, pages - 1)]))
                for n, excess in enumerate(excesses)
            ]
        )
        if much.max() <= 1.0:
            break
        much = of_both_pages(much, pages).swapaxes(0, 1)
        values[-2:] /= much if turn == GENTLE else np.sqrt(much)
    return values


def on_grid(sums: LinkedSums, rows: int) -> Excess:
    """Of sums in the middles of a `DirectionGrid`'s cells of the first rows, from weights on it."""

    def excess(pages: Array) -> Array:
        here = np.stack([_amid(page, np.roll(page, -1, axis=1))[:rows] for page in pages])
        found = np.ones_like(pages[:2, :-1])
        found[:, :rows] = _excess(sums, pages, here)
        return np.stack([largest_around(cells) for cells in found])

    return excess


def on_chains(chains: Sequence[ChainSides]) -> Excess:
    """Of sums of all chains, by length, in the middles of a `GratingGrid`'s cells."""

    def excess(pages: Array) -> Array:
        right = np.concatenate([pages[..., 1:], pages[..., -1:]], axis=-1)
        here = np.stack([_amid(*both) for both in zip(pages, right, strict=True)])
        cells = np.ones_like(here[:2])
        for last, sums in enumerate(chains):
            own = np.stack([np.stack(list(_cells(one, last)), axis=-1) for one in here])
            certain = sums.angle <= LinkedSums.certain  # cells are wide in angle beyond
            much = np.where(certain, _excess(sums, own, own), np.float32(1.0))
            for page, found in zip(cells, much, strict=True):
                put(page, found, last)
        found = np.ones_like(cells)
        for rows in (slice(None, -1), slice(1, None)):
            for columns in (slice(None, -1), slice(1, None)):
                part = found[:, rows, columns]
                np.maximum(part, cells[:, :-1, :-1], out=part)
        return found

    return excess


def _excess(sums: LinkedSums, pages: Sums, here: Sums) -> Array:
    """From scales where weights are, and at the directions of the sums."""
    changed, zeroth = sums.changed(pages[:2], here[:2]), here[:2] * sums.zeroth(pages[:2])
    if len(pages) == 4:
        found = here[2:] * changed(pages[2:]) / CEILING
    else:
        much = changed(np.ones_like(pages[:2])) - CEILING
        found = zeroth / np.maximum(zeroth - much, zeroth / MOST)
    return np.asarray(np.clip(found, 1.0, MOST), np.float32)


def _amid(page: Array, right: Array) -> Array:
    """Means of a cell's corners; of the last row, of its own."""
    row = 0.5 * (page + right)
    return np.asarray(0.5 * (row + np.concatenate([row[1:], row[-1:]])), np.float32)


def _cells(page: Array, last: int) -> Iterator[Array]:
    """Those (NODES, NODES) of a chain's directions."""
    for k in range(last + 1):
        row, column = k * NODES, (last - k) * NODES
        yield page[row : row + NODES, column : column + NODES]
