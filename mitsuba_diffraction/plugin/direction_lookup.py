"""Functions of direction and channel, as `tables.energy` tabulates them, in a kernel (Dr.Jit)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..arrays import Single
from ..optics.colour import daylight_shares
from ..optics.geometry import wavenumber
from ..tables.directional import SHARE, DirectionalTable
from .arithmetic import clip, float_of, index_of
from .directions import Site
from .energy_factors import ScaleRange
from .layers import Thickness
from .memory import index_between, read, read_record, upload
from .types import Buffer, Float, Index, Vector2f, Vector3f


class DirectionLookup:
    """A function of direction and channel in the variant's memory, bilinear in (θ, φ).

    It is of directions above the surface, or of both sides: rows of cells of the lower side follow
    those of the upper one.

    Parameters
    ----------
    tables : of one or two sides, at evenly spaced height scales, `nodes`; or at thicknesses.
    thickness : of a film; `nodes` are thicknesses then, nm.
    fringes : whether a value between wavelengths is that of the same fringe at both, of a film of
        the same share of the wavelength. At the same thickness fringes would be missed.
    filmed : whether the material has a film. Where the stretch alone varies, a value is then
        interpolated between height scales at the same wavelength, each on a patch of its stretch.
    exponent : of the mean over a colour's light. That of scales s is −2: an albedo a asks for
        s = 1/√a, so a colour's mean of s² a is 1 where 1/s² is the colour's albedo.
    """

    def __init__(
        self,
        tables: Sequence[Sequence[DirectionalTable]],
        nodes: list[float],
        scales: ScaleRange,
        thickness: Thickness | None = None,
        *,
        fringes: bool = False,
        exponent: float = 1.0,
        filmed: bool = False,
    ) -> None:
        height_scale, varies = scales.height_scale, scales.varies or thickness is not None
        self._thickness, self._fringes = thickness, fringes and thickness is not None
        stretches = [scales.centre if thickness else scales.stretch_at(node) for node in nodes]
        pairs = zip(tables, stretches, strict=True)
        maps = np.stack([[_cells(side, by, exponent) for side in sides] for sides, by in pairs])
        self._sides, self._polar, self._azimuthal, self._pages, self._record = maps.shape[1:]
        self._last, self._varies = len(nodes) - 2, varies
        width = (nodes[-1] - nodes[0]) / (len(nodes) - 1)
        self._values: Buffer = None
        if not varies:
            share = np.float32((height_scale - nodes[0]) / width if width > 0.0 else 0.0)
            self._values = upload(mi.Float, maps[0] * (1 - share) + maps[1] * share)
        # Where there is but one node nothing varies with the height scale
        self._nodes = upload(mi.Float, maps) if varies or width > 0.0 else None
        wavelengths = tables[0][0].wavelengths
        self._low = mi.Float(nodes[0])
        self._slope = mi.Float(1.0 / width if width > 0.0 else 0.0)
        self._first = mi.Float(math.log2(float(wavenumber(wavelengths[0]))))
        octaves = math.log2(wavelengths[-1] / wavelengths[0])
        self._pages_per_log = mi.Float((len(wavelengths) - 1) / octaves if octaves > 0.0 else 0.0)
        self._logs_per_page = mi.Float(octaves / max(len(wavelengths) - 1, 1))
        own = filmed and len(set(stretches)) > 1
        self._stretches = upload(mi.Float, np.array(stretches, np.float32)) if own else None
        dr.make_opaque(
            self._low, self._slope, self._first, self._pages_per_log, self._logs_per_page
        )

    def at(self, direction: Vector3f, site: Site) -> list[Float]:
        """Return the value of each channel for a direction in the shading frame."""
        frame, wavenumbers = site.frame, site.wavenumbers
        cosine = mi.Frame3f.cos_theta(direction)
        tangential, share = frame.turned(direction), None
        if self._thickness is None:
            place = site.scale * dr.rcp(frame.stretch)
        else:
            place = self._thickness.at(site.si, mi.Mask(True))
        if self._nodes is not None and (self._varies or dr.grad_enabled(place)):
            share = (place - self._low) * self._slope
        both = self._sides == 2
        cell, s, t = self._cell(*self._place(tangential, dr.abs(cosine) if both else cosine))
        if both:
            cell = dr.select(cosine > 0.0, cell, cell + self._polar * self._azimuthal)

        def pages(n: Index, share: Float | None = share) -> list[Float]:
            corners = self._corners(cell * self._pages + n, share)
            fours = (corners[start : start + 4] for start in range(0, self._record, 4))
            return [dr.lerp(dr.lerp(a, b, t), dr.lerp(c, d, t), s) for a, b, c, d in fours]

        if self._record == 4:
            last = self._pages - 1
            return [pages(mi.UInt32(min(n, last)))[0] for n in range(len(wavenumbers))]

        def between(k: Float, stretch: Float, share: Float | None) -> Float:
            at = (self._first - dr.log2(k * stretch)) * self._pages_per_log
            n = index_of(index_between(at, 0.0, self._pages - 1.0))
            within = clip(at - float_of(n), 0.0, 1.0)
            if self._fringes:  # at thicknesses d λn/λ
                ratios = [dr.exp2((end - within) * self._logs_per_page) for end in (0.0, 1.0)]
                shares = [(place * ratio - self._low) * self._slope for ratio in ratios]
                return dr.lerp(*(pages(n, each)[end] for end, each in enumerate(shares)), within)
            return dr.lerp(*pages(n, share), within)

        values = []
        for k in wavenumbers:
            if self._stretches is None:
                values.append(between(k, frame.stretch, share))
                continue
            lower = index_between(dr.floor(share), 0.0, float(self._last))
            ends = [lower, lower + 1.0]
            stretches = [read(mi.Float, self._stretches, index_of(end)) for end in ends]
            both = [between(k, *end) for end in zip(stretches, ends, strict=True)]
            values.append(dr.lerp(*both, clip(share - lower, -0.01, 1.01)))
        return values

    def _place(self, tangential: Vector2f, cosine: Float) -> tuple[Float, Float]:
        """Row and column of a `DirectionGrid`."""
        remaining = 1.0 - dr.safe_acos(cosine) * (2.0 / dr.pi)
        row = (1.0 - dr.safe_sqrt(remaining)) * (self._polar / SHARE)
        column = dr.atan2(tangential.y, tangential.x) * (self._azimuthal / (2.0 * dr.pi))
        return row, dr.select(column < 0.0, column + self._azimuthal, column)

    def _cell(self, row: Float, column: Float) -> tuple[Index, Float, Float]:
        """A cell, and where in it."""
        i = index_of(index_between(row, 0.0, self._polar - 1.0))
        j = index_of(index_between(column, 0.0, self._azimuthal - 1.0))
        s, t = clip(row - float_of(i), 0.0, 1.0), clip(column - float_of(j), 0.0, 1.0)
        return i * self._azimuthal + j, s, t

    def _corners(self, page: Index, share: Float | None) -> list[Float]:
        """Values at the corners of a cell on the pages of a record, given by its number in memory.

        share : position between height scales, in units of their distance; None where the uploaded
            values are interpolated already.
        """
        if share is None:
            return read_record(self._values, page, self._record)
        lower = index_between(dr.floor(share), 0.0, float(self._last))
        size = self._pages * self._sides * self._polar * self._azimuthal
        page = page + index_of(lower) * size
        ends = (read_record(self._nodes, at, self._record) for at in (page, page + size))
        # no farther, where values might become negative; derivatives at the ends are as inside
        share = clip(share - lower, -0.01, 1.01)
        return [dr.lerp(*both, share) for both in zip(*ends, strict=True)]


def scales_of(
    tables: Sequence[Sequence[DirectionalTable] | None],
) -> Sequence[Sequence[DirectionalTable]] | None:
    """Scales of all sides at several nodes, 1 where there is none; None if all are 1.

    They have the wavelengths of those that have most.
    """
    present = [sides for sides in tables if sides is not None]
    if not present:
        return None
    finest = max(present, key=lambda sides: len(sides[0].wavelengths))
    light = finest[0].wavelengths
    return [
        [side if len(side.wavelengths) == len(light) else _at_light(side, light) for side in sides]
        for sides in (sides or ones_like(finest) for sides in tables)
    ]


def _at_light(table: DirectionalTable, wavelengths: NDArray[np.float64]) -> DirectionalTable:
    """Interpolate to other wavelengths, nm."""
    return DirectionalTable(wavelengths, np.stack([table.page(nm) for nm in wavelengths.tolist()]))


def ones_like(sides: Sequence[DirectionalTable]) -> list[DirectionalTable]:
    """Tables of 1 of the form of others."""
    return [DirectionalTable(side.wavelengths, np.ones_like(side.values)) for side in sides]


def between(
    tables: Sequence[DirectionalTable], nodes: Sequence[float], height_scale: float
) -> DirectionalTable:
    """Interpolate between two height scales."""
    low, high = tables
    width = nodes[1] - nodes[0]
    share = np.float32((height_scale - nodes[0]) / width if width > 0.0 else 0.0)
    return DirectionalTable(low.wavelengths, low.values * (1 - share) + high.values * share)


def _cells(table: DirectionalTable, stretch: float, exponent: float) -> Single:
    """Values at the corners of each cell, (rows, columns, channels, 4).

    Spectra have intervals of wavelengths instead of channels, and 8 values: of both ends.

    stretch : factor from the table's wavelengths to the light's.
    exponent : as of `DirectionLookup`.

    All wavelengths of a cell lie together: a call reads several of them, within few cache lines.
    """
    values = table.values
    if mi.is_rgb and len(values) > 1:
        powers = values**exponent
        colours = np.tensordot(daylight_shares(table.wavelengths * stretch).T, powers, 1)
        # red has negative weights in blue and green: its mean may be beyond all of the light's
        limited = np.clip(colours, powers.min(axis=0), powers.max(axis=0))
        values = np.asarray(limited ** (1.0 / exponent), np.float32)
    right = np.roll(values, -1, axis=2)
    corners = (values[:, :-1], right[:, :-1], values[:, 1:], right[:, 1:])
    cells = np.stack(corners, axis=-1).transpose(1, 2, 0, 3)
    if mi.is_rgb or len(values) == 1:
        return cells
    return np.concatenate([cells[:, :, :-1], cells[:, :, 1:]], axis=-1)
