"""R + T amid the nodes of a scale: what is too much there, and what is lacking (NumPy only).

Between directions and wavelengths of the scale an order may appear or vanish. So the sums are
looked at amid them too: what is too much is taken from the nodes around, and what is given to nodes
is what is lacking amid them. Each node takes the mean of what the cells around it ask for, and
those that ask for nothing do not count; what is too much after that is taken altogether.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from .chains import put, taken
from .links import Real
from .sheet import ChainSides
from .sums import LinkedSums, Sums

Array = NDArray[np.float32]
#: What R + T is brought below, and above by what is spread; how often by the mean of what is asked
#: for, before by the largest; and by how much at most at a time.
CEILING, FLOOR, GENTLE, MOST = 0.997, 0.985, 2, 1.5
#: And up to which polar angle of a `DirectionGrid`, rad; between which ever less of what is lacking
#: is told, as part of a lobe is below the horizon.
LOOKED_AT = float(np.radians(80.0))
FALLS = float(np.radians(80.0)), float(np.radians(85.0))
#: R + T amid nodes that is below the first in a share of them above the second is not left at that.
FAR, FEW = 0.98, 0.03


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
        """By what share they are too bright, and how far they are below `CEILING`.

        pages : of scales, (2 or 4, …).
        """

    @abstractmethod
    def amid(self, page: Array) -> Array:
        """Means of a page of a scale: one side's."""

    @abstractmethod
    def around(self, cells: Array) -> Array:
        """The four cells around each node, of one side: (rows, columns, 4)."""


def lowered(values: Array, cells: Sequence[Cells]) -> Array:
    """Scales (2 or 4, wavelengths, rows, columns): c of both sides, and s, which is lowered then.

    cells : amid each two of the wavelengths, or at the one.
    """
    values = values.copy()
    for turn in range(GENTLE + 1):
        much = [one.excess_and_room(v)[0] for one, v in _amid_pages(cells, values)]
        values[-2:] /= 1.0 + _at_nodes(cells, much, turn)
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


def fitted(wanted: Array, most: Array, cells: Sequence[Cells], room_amid: Sequence[Array]) -> Array:
    """What is spread, (2, wavelengths, rows, columns), from what is wanted at nodes.

    Between 0 and `most` there, and amid them at most the room; as far as it can be, no less than
    brings R + T to `FLOOR`.
    """
    found = wanted
    for turn in range(GENTLE + 1):
        off = []
        for (one, pages), room in zip(_amid_pages(cells, found), room_amid, strict=True):
            here = np.stack([one.amid(page) for page in pages])
            certain = one.angles <= LinkedSums.certain
            least = np.where(certain, np.maximum(room - (CEILING - FLOOR), 0.0), 0.0)
            off.append(here - np.clip(here, least, room))
        found = np.clip(found - _at_nodes(cells, off, turn), 0.0, most)
    return found


def _amid_pages(cells: Sequence[Cells], values: Array) -> Iterator[tuple[Cells, Array]]:
    """Cells, and a scale's values amid two of its wavelengths."""
    last = values.shape[1] - 1
    for n, one in enumerate(cells):
        yield one, 0.5 * (values[:, n] + values[:, min(n + 1, last)])


def _at_nodes(cells: Sequence[Cells], off: Sequence[Array], turn: int) -> Array:
    """What cells are too much by, at the nodes around: (2, wavelengths, rows, columns)."""
    around = np.stack([
        [one.around(side) for side in found] for one, found in zip(cells, off, strict=True)
    ])  # fmt: skip
    if len(cells) > 1:
        pages = np.concatenate([around[:1], around]), np.concatenate([around, around[-1:]])
        around = np.concatenate(pages, axis=-1)
    around = around.swapaxes(0, 1)
    if turn == GENTLE:
        return np.maximum(around.max(axis=-1), np.float32(0.0))
    return np.asarray(around.sum(axis=-1) / np.maximum(np.count_nonzero(around, axis=-1), 1))


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
        excess, room = np.zeros_like(pages[:2, :-1]), np.zeros_like(pages[:2, :-1])
        much, little = excess_and_room(self._sums, pages, here)
        looked_at = self.angles[:, : self._rows] <= LOOKED_AT
        excess[:, : self._rows] = np.where(looked_at, much, np.float32(0.0))
        room[:, : self._rows] = little
        return excess, room

    def amid(self, page: Array) -> Array:
        return _amid(page, np.roll(page, -1, axis=1))[:-1]

    def around(self, cells: Array) -> Array:
        first = np.full_like(cells[:1], cells[0, np.argmax(np.abs(cells[0]))])  # meet at the normal
        rows = np.concatenate([first, cells]), np.concatenate([first, cells[1:], cells[-1:]])
        return np.stack([*rows, *(np.roll(one, 1, axis=1) for one in rows)], axis=-1)


class ChainCells(Cells):
    """Those of a `GratingGrid`, from all chains, by length.

    Parameters
    ----------
    chains : in the middles, or where cells reach beyond the hemisphere, before its end.
    shares : of the way from their first nodes to the next, (nodes, nodes) of each length.
    """

    def __init__(self, chains: Sequence[ChainSides], shares: Sequence[Real]) -> None:
        self._chains = chains
        rows = len(chains) * len(shares[0])
        self.angles = np.full((2, rows, rows), 0.5 * np.pi)
        self._share = np.full((rows, rows), 0.5, np.float32)
        for last, (sums, share) in enumerate(zip(chains, shares, strict=True)):
            for side in self.angles:
                put(side, sums.angle, last)
            put(self._share, np.repeat(share[..., None], last + 1, axis=-1), last)

    def excess_and_room(self, pages: Array) -> tuple[Array, Array]:
        here = np.stack([self.amid(page) for page in pages])
        excess, room = np.zeros_like(here[:2]), np.zeros_like(here[:2])
        for last, sums in enumerate(self._chains):
            own = np.stack([taken(one, last, len(sums.angle)) for one in here])
            much, little = excess_and_room(sums, own, own)
            certain = sums.angle <= LinkedSums.certain  # cells are wide in angle beyond
            much = np.where(certain, much, np.float32(0.0))
            for side in (0, 1):
                put(excess[side], much[side], last)
                put(room[side], little[side], last)
        return excess, room

    def amid(self, page: Array) -> Array:
        return _amid(page, np.concatenate([page[:, 1:], page[:, -1:]], axis=1), self._share)

    def around(self, cells: Array) -> Array:
        rows = cells, np.concatenate([cells[:1], cells[:-1]])
        left = (np.concatenate([one[:, :1], one[:, :-1]], axis=1) for one in rows)
        return np.stack([*rows, *left], axis=-1)


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
    return np.asarray(np.clip(excess, 1.0, MOST) - 1.0, np.float32), np.asarray(room, np.float32)


def _amid(page: Array, right: Array, share: float | Array = 0.5) -> Array:
    """Bilinear between a cell's corners, at one share of both ways; of the last row, its own."""
    below = [np.concatenate([one[1:], one[-1:]]) for one in (page, right)]
    low, high = (one + share * (other - one) for one, other in ((page, right), below))
    return np.asarray(low + share * (high - low), np.float32)
