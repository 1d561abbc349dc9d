"""Functions of direction and channel, as `tables.energy` tabulates them, in a kernel (Dr.Jit)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..optics.colour import linear_srgb, response
from ..optics.geometry import wavenumber
from ..tables.energy.conservation import DirectionalTable
from ..tables.energy.grating import DENSE, ENDS, Grating
from ..tables.energy.grid import SHARE, DirectionGrid
from .memory import index_between, read_record, upload
from .types import Buffer, Float, Index, Vector2f

Array = NDArray[np.float32]
#: Directions of a grating's s in RGB, whose channels are means over wavelengths.
_COLOURS = DirectionGrid(80, 120)


class DirectionLookup:
    """A function of direction and channel in the variant's memory, bilinear in (θ, φ)."""

    def __init__(self) -> None:
        self.present = False
        self._values: Buffer = None
        self._nodes: Buffer = None
        self._last, self._varies = 0, False
        self._low, self._slope = mi.Float(0.0), mi.Float(0.0)
        self._first, self._pages_per_log = mi.Float(0.0), mi.Float(0.0)
        self._pages = self._polar = self._azimuthal = 1
        self._grating: Grating | None = None

    def update(
        self,
        tables: list[DirectionalTable] | None,
        nodes: list[float],
        height_scale: float,
        varies: bool,
    ) -> None:
        """Take the tables at evenly spaced height scales, or none."""
        self.present = tables is not None
        if tables is None:
            return
        self._grating = None if mi.is_rgb else tables[0].grating
        maps = np.stack([_pages(table) for table in tables])
        self._pages, self._polar, self._azimuthal = maps.shape[1:4]
        self._last, self._varies = len(nodes) - 2, varies
        width = (nodes[-1] - nodes[0]) / (len(nodes) - 1)
        if not varies:
            share = np.float32((height_scale - nodes[0]) / width if width > 0.0 else 0.0)
            self._values = upload(mi.Float, maps[0] * (1 - share) + maps[1] * share)
        # Where there is but one node nothing varies with the height scale
        self._nodes = upload(mi.Float, maps) if varies or width > 0.0 else None
        wavelengths = tables[0].wavelengths
        self._low = mi.Float(nodes[0])
        self._slope = mi.Float(1.0 / width if width > 0.0 else 0.0)
        self._first = mi.Float(math.log2(float(wavenumber(wavelengths[0]))))
        octaves = math.log2(wavelengths[-1] / wavelengths[0])
        self._pages_per_log = mi.Float((len(wavelengths) - 1) / octaves if octaves > 0.0 else 0.0)
        dr.make_opaque(self._low, self._slope, self._first, self._pages_per_log)

    def at(
        self, tangential: Vector2f, cosine: Float, wavenumbers: list[Float], height_scale: Float
    ) -> list[Float]:
        """For each channel; tangential in the patch's frame."""
        share = None
        if self._nodes is not None and (self._varies or dr.grad_enabled(height_scale)):
            share = (height_scale - self._low) * self._slope
        if self._grating is None:
            at = self._cell(*self._place(tangential, cosine))
            cells = [at] * len(wavenumbers)
        else:
            cells = [self._cell(*_chain(self._grating, tangential, k)) for k in wavenumbers]

        def page(n: Index, at: tuple[Index, Float, Float]) -> Float:
            cell, s, t = at
            corners = self._corners(n * (self._polar * self._azimuthal) + cell, share)
            return dr.lerp(dr.lerp(*corners[:2], t), dr.lerp(*corners[2:], t), s)

        if mi.is_rgb or self._pages == 1:
            last = self._pages - 1
            return [page(mi.UInt32(min(n, last)), at) for n, at in enumerate(cells)]
        found = []
        for k, at in zip(wavenumbers, cells, strict=True):
            place = (self._first - dr.log2(k)) * self._pages_per_log
            n = mi.UInt32(index_between(place, 0.0, self._pages - 2.0))
            found.append(dr.lerp(page(n, at), page(n + 1, at), dr.clip(place - n, 0.0, 1.0)))
        return found

    def _place(self, tangential: Vector2f, cosine: Float) -> tuple[Float, Float]:
        """Row and column of a `DirectionGrid`."""
        remaining = 1.0 - dr.safe_acos(cosine) * (2.0 / dr.pi)
        row = (1.0 - dr.safe_sqrt(remaining)) * (self._polar / SHARE)
        column = dr.atan2(tangential.y, tangential.x) * (self._azimuthal / (2.0 * dr.pi))
        return row, dr.select(column < 0.0, column + self._azimuthal, column)

    def _cell(self, row: Float, column: Float) -> tuple[Index, Float, Float]:
        """A cell, and where in it."""
        i = mi.UInt32(index_between(row, 0.0, self._polar - 1.0))
        j = mi.UInt32(index_between(column, 0.0, self._azimuthal - 1.0))
        s, t = dr.clip(row - i, 0.0, 1.0), dr.clip(column - j, 0.0, 1.0)
        return i * self._azimuthal + j, s, t

    def _corners(self, cell: Index, share: Float | None) -> list[Float]:
        """Values at a cell's corners; interpolated here only where they vary or a derivative is
        wanted.

        share : of the way to the second node, or the number of one and the share of the way on.
        """
        if share is None:
            return read_record(self._values, cell, 4)
        lower = index_between(dr.floor(share), 0.0, float(self._last))
        size = self._pages * self._polar * self._azimuthal
        cell = cell + mi.UInt32(lower) * size
        ends = (read_record(self._nodes, at, 4) for at in (cell, cell + size))
        return [dr.lerp(*both, share - lower) for both in zip(*ends, strict=True)]


def scales_of(
    found: Sequence[DirectionalTable | None], otherwise: float = 1.0
) -> list[DirectionalTable] | None:
    """s of each on the same directions, `otherwise` where it is None; nothing if all are."""
    made = next((one for one in found if one is not None), None)
    if made is None:
        return None
    others = replace(made, values=np.full_like(made.values, otherwise))
    scales = [one or others for one in found]
    return scales if made.grating is not None else alike(scales)


def _chain(grating: Grating, tangential: Vector2f, wavenumber: Float) -> tuple[Float, Float]:
    """Row and column of a `tables.energy.grating.GratingGrid`."""
    cosine, sine = grating.axis
    x = cosine * tangential.x + sine * tangential.y
    y = cosine * tangential.y - sine * tangential.x
    width, per_x = dr.safe_sqrt(dr.fma(-y, y, 1.0)), wavenumber / grating.spacing
    parts, last, rows = grating.nodes - ENDS, grating.last, []
    for one in (width - x, width + x):
        xi = dr.maximum(one * per_x, 0.0)
        whole = dr.floor(xi)
        rest = xi - whole
        root = dr.sqrt(rest / last)
        within = root * dr.rcp(root + DENSE) * ((1.0 + DENSE) * parts)
        beyond = (rest - last) * (ENDS / (1.0 - last)) + parts
        rows.append(dr.fma(whole, grating.nodes, dr.select(rest < last, within, beyond)))
    return rows[0], rows[1]


def between(
    tables: list[DirectionalTable], nodes: tuple[float, float], height_scale: float
) -> DirectionalTable:
    """Interpolated between two height scales."""
    low, high = alike(tables)
    width = nodes[1] - nodes[0]
    share = np.float32((height_scale - nodes[0]) / width if width > 0.0 else 0.0)
    return DirectionalTable(low.wavelengths, low.values * (1 - share) + high.values * share)


def alike(tables: list[DirectionalTable]) -> list[DirectionalTable]:
    """Albedos or scales, all on the directions and wavelengths of the finest."""
    finest = max(tables, key=lambda table: table.values.size)
    theta, phi = finest.grid.theta[:, None], finest.grid.phi
    return [
        table
        if table.values.shape == finest.values.shape
        else DirectionalTable(
            finest.wavelengths,
            np.stack([table.at(theta, phi, wavelength) for wavelength in finest.wavelengths]),
        )
        for table in tables
    ]


def _pages(table: DirectionalTable) -> Array:
    """All four corners of each cell together: (channels or wavelengths, rows, columns, 4)."""
    if table.grating is not None and not mi.is_rgb:
        values = np.pad(table.values, [(0, 0), (0, 0), (0, 1)], mode="edge")
        right, values = values[:, :, 1:], table.values
        corners = (values[:, :-1], right[:, :-1], values[:, 1:], right[:, 1:])
        return np.stack(corners, axis=-1)
    values = table.values if table.grating is None else table.on(_COLOURS).values
    if mi.is_rgb and len(values) > 1:
        values = np.tensordot(_sensitivities(table.wavelengths), values, 1).astype(np.float32)
    right = np.roll(values, -1, axis=2)
    corners = (values[:, :-1], right[:, :-1], values[:, 1:], right[:, 1:])
    return np.stack(corners, axis=-1)


def _sensitivities(wavelengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """How much each wavelength counts in red, green and blue, (3, n)."""
    weights = np.maximum(linear_srgb(response(wavelengths)).T, 0.0) * wavelengths
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))
