"""R + T amid the nodes of a scale: what is too much there, and what is lacking (NumPy only).

Between directions and wavelengths of the scale an order may appear or vanish. So the sums are
looked at amid them too: what was too much is taken from the nodes around, and what they lack is
the least of what is lacking around them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from .chains import put, taken
from .conservation import largest_around, of_both_pages
from .links import Real
from .sheet import ChainSides
from .sums import LinkedSums, Sums

Array = NDArray[np.float32]
#: What R + T is brought below; how often by the root of what is too much, before by all of it; and
#: by how much at most at a time.
CEILING, GENTLE, MOST = 0.9995, 2, 1.5
#: And up to which polar angle of a `DirectionGrid`, rad; between which ever less of what is lacking
#: is told, as part of a lobe is below the horizon.
LOOKED_AT = float(np.radians(80.0))
FALLS = float(np.radians(80.0)), float(np.radians(85.0))
#: R + T amid nodes that is below the first in a share of them above the second is not left at that:
#: where few are, they are kinks that nodes lie beside.
FAR, FEW = 0.95, 0.02


class Cells(ABC):
    """The middles of all cells of a scale, at one wavelength.

    Cells are (2, rows, columns), of both sides.

    Attributes
    ----------
    angles : of their middles to the normal, rad, that broadcast to them.
    """

    angles: Real

    @abstractmethod
    def excess_and_room(self, pages: Array) -> tuple[Array, Array]:
        """By what factor they are too bright, and how far they are below `CEILING`.

        pages : of scales, (2 or 4, …).
        """

    @abstractmethod
    def amid(self, page: Array) -> Array:
        """Means of a page of a scale: one side's."""

    @abstractmethod
    def around(self, cells: Array) -> Array:
        """The largest of the cells around each node, of one side."""


def lowered(values: Array, cells: Sequence[Cells]) -> Array:
    """Scales (2 or 4, wavelengths, rows, columns): c of both sides, and s, which is lowered then.

    cells : amid each two of the wavelengths, or at the one.
    """
    values = values.copy()
    for turn in range(GENTLE + 1):
        much = _at_nodes(
            cells, [one.excess_and_room(v)[0] for one, v in _amid_pages(cells, values)]
        )
        if much.max() <= 1.0:
            break
        values[-2:] /= much if turn == GENTLE else np.sqrt(much)
    return values


def rooms(values: Array, cells: Sequence[Cells]) -> list[Array]:
    """What R + T is below `CEILING` in cells, by scales as `lowered` gives them."""
    return [
        one.excess_and_room(pages)[1] * np.interp(one.angles, FALLS, (1.0, 0.0)).astype(np.float32)
        for one, pages in _amid_pages(cells, values)
    ]


def is_lacking(found: Sequence[Array], cells: Sequence[Cells]) -> bool:
    """Whether R + T of such rooms is far below 1 in more than few cells where it is to be near."""
    certain = [one.angles <= LinkedSums.certain for one in cells]
    far = [room > CEILING - FAR for room in found]
    count = sum(float(np.sum(a & b)) for a, b in zip(far, certain, strict=True))
    return count > FEW * sum(float(np.sum(np.broadcast_to(one, far[0].shape))) for one in certain)


def at_most(found: Array, cells: Sequence[Cells], most: Sequence[Array]) -> Array:
    """Values (2, wavelengths, rows, columns) lowered to be at most so much amid."""
    for turn in range(GENTLE + 1):
        over = [
            np.maximum(np.stack([one.amid(page) for page in pages]) - limit, 0.0)
            for (one, pages), limit in zip(_amid_pages(cells, found), most, strict=True)
        ]
        found = found - _at_nodes(cells, over) * (1.0 if turn == GENTLE else 0.5)
    return np.maximum(found, 0.0)


def _amid_pages(cells: Sequence[Cells], values: Array) -> Iterator[tuple[Cells, Array]]:
    """Cells, and a scale's values amid two of its wavelengths."""
    last = values.shape[1] - 1
    for n, one in enumerate(cells):
        yield one, 0.5 * (values[:, n] + values[:, min(n + 1, last)])


def _at_nodes(cells: Sequence[Cells], found: Sequence[Array]) -> Array:
    """The largest around each node, (2, wavelengths, rows, columns)."""
    largest = np.stack([
        [one.around(side) for side in of_one] for one, of_one in zip(cells, found, strict=True)
    ])  # fmt: skip
    return of_both_pages(largest, len(cells) + (len(cells) > 1)).swapaxes(0, 1)


class GridCells(Cells):
    """Those of a `DirectionGrid`, as far as they are looked at.

    Parameters
    ----------
    sums : in their middles, of the first rows, from weights on it.
    angles : polar angles of these rows on both sides, rad, (2, …).
    rows : of all cells.
    """

    def __init__(self, sums: LinkedSums, angles: Real, rows: int) -> None:
        self._sums, self._rows = sums, angles.shape[1]
        self.angles = np.pad(angles, [(0, 0), (0, rows - self._rows)], constant_values=0.5 * np.pi)
        self.angles = self.angles[..., None]

    def excess_and_room(self, pages: Array) -> tuple[Array, Array]:
        here = np.stack([self.amid(page)[: self._rows] for page in pages])
        excess, room = np.ones_like(pages[:2, :-1]), np.zeros_like(pages[:2, :-1])
        much, little = excess_and_room(self._sums, pages, here)
        looked_at = self.angles[:, : self._rows] <= LOOKED_AT
        excess[:, : self._rows] = np.where(looked_at, much, np.float32(1.0))
        room[:, : self._rows] = little
        return excess, room

    def amid(self, page: Array) -> Array:
        return _mean(page, np.roll(page, -1, axis=1))[:-1]

    def around(self, cells: Array) -> Array:
        return largest_around(cells)


class ChainCells(Cells):
    """Those of a `GratingGrid`, from all chains, by length."""

    def __init__(self, chains: Sequence[ChainSides], rows: int) -> None:
        self._chains = chains
        self.angles = np.full((2, rows, rows), 0.5 * np.pi)
        for last, sums in enumerate(chains):
            for side in self.angles:
                put(side, sums.angle, last)

    def excess_and_room(self, pages: Array) -> tuple[Array, Array]:
        here = np.stack([self.amid(page) for page in pages])
        excess, room = np.ones_like(here[:2]), np.zeros_like(here[:2])
        for last, sums in enumerate(self._chains):
            own = np.stack([taken(one, last) for one in here])
            much, little = excess_and_room(sums, own, own)
            certain = sums.angle <= LinkedSums.certain  # cells are wide in angle beyond
            much = np.where(certain, much, np.float32(1.0))
            for side in (0, 1):
                put(excess[side], much[side], last)
                put(room[side], little[side], last)
        return excess, room

    def amid(self, page: Array) -> Array:
        return _mean(page, np.concatenate([page[:, 1:], page[:, -1:]], axis=1))

    def around(self, cells: Array) -> Array:
        found = cells.copy()
        np.maximum(found[1:], cells[:-1], out=found[1:])
        both = found.copy()
        np.maximum(found[:, 1:], both[:, :-1], out=found[:, 1:])
        return found


def excess_and_room(sums: LinkedSums, pages: Sums, here: Sums) -> tuple[Array, Array]:
    """From scales where weights are, and at the directions of the sums."""
    total: Sums
    changed, zeroth = sums.changed(pages[:2], here[:2]), here[:2] * sums.zeroth(pages[:2])
    if len(pages) == 4:
        total = here[2:] * changed(pages[2:])
        excess = total / CEILING
    else:
        total = changed(np.ones_like(pages[:2]))
        excess = zeroth / np.maximum(zeroth - (total - CEILING), zeroth / MOST)
    room = np.clip(CEILING - total, 0.0, None)
    return np.asarray(np.clip(excess, 1.0, MOST), np.float32), np.asarray(room, np.float32)


def _mean(page: Array, right: Array) -> Array:
    """Means of a cell's corners; of the last row, of its own."""
    row = 0.5 * (page + right)
    return np.asarray(0.5 * (row + np.concatenate([row[1:], row[-1:]])), np.float32)
