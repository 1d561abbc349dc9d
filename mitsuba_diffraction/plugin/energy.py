"""Energy conservation, and the light that goes beneath (Dr.Jit): `tables.energy` in a kernel.

What is reflected is multiplied by s(ωi) s(ωo), reciprocal, where the model would reflect more than
it gets; T = 1 − a(ω) of a dielectric's own albedo goes on to what lies beneath.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionWarning
from ..optics import fresnel
from ..optics.colour import RGB_WAVELENGTHS, linear_srgb, response
from ..optics.geometry import wavenumber
from ..tables.energy.conservation import FINE, Conservation, DirectionalTable
from ..tables.energy.gain import GRAZING
from ..tables.energy.grating import ENDS, LAST_NODE, NODES, Grating
from ..tables.energy.grid import SHARE, DirectionGrid
from ..tables.store.energy import Energy
from ..tables.table import DiffractionTable
from .boundary import Boundary, Kirchhoff
from .film import UnderFilm, plain
from .memory import index_between, read_record, upload
from .pair import Pair
from .reflectance import Inside, Perfect, Reflectance
from .roles import Buffer, Colour, Float, Index, Vector2f

Array = NDArray[np.float32]
#: Of wavelengths (n,).
Indices = NDArray[np.complex128] | fresnel.Filmed

#: Indices are rounded to this, real and imaginary part, for s and the ratio of albedos.
INDEX_STEP = 0.05
#: And a film's thickness, nm.
THICKNESS_STEP = 5.0
#: Largest ratio of a film's albedo to that of the flat one.
MOST_RATIO = 2.0
#: What is taken beyond this share of a real material is warned of.
MUCH = 0.05


#: Directions of a grating's s in RGB, whose channels are means over wavelengths.
_COLOURS = DirectionGrid(80, 120)


class EnergyModel:
    """Of one BSDF, at the height scale and the material last given.

    Parameters
    ----------
    table, boundary : of the BSDF.
    wavelength : nm, for mono variants.
    conserving : whether anything is to be taken.
    """

    def __init__(
        self, table: DiffractionTable, boundary: Boundary, wavelength: float, conserving: bool
    ) -> None:
        low, high = table.wavelength_range
        if mi.is_monochromatic:
            low = high = wavelength
        kirchhoff = isinstance(boundary, Kirchhoff)
        self.conserving, self._material = conserving, boundary.material
        self._indices = partial(_rounded_indices, self._material)
        model = "kirchhoff" if kirchhoff else "small_slope"
        self._energy = Energy(table, model, self._indices, (low, high))
        self._kirchhoff = self._fades = kirchhoff
        self._warned = False
        self._scale = Lookup()
        self._reflected = Lookup()

    def update(
        self,
        height_scale: float,
        differentiable: bool,
        beneath: bool,
        lowest: float | None = None,
    ) -> None:
        """Look up, or compute, what belongs to another height scale or material.

        beneath : whether light goes on to something.
        lowest : where height scales vary, the least of them; then height_scale is the largest.
        """
        if not (self.conserving or beneath):
            return
        if lowest is None:
            nodes = list(self._energy.nodes(height_scale, interval=differentiable))
        else:
            nodes = self._energy.between(lowest, height_scale)
        found = [self._energy.at(node) for node in nodes]
        if self.conserving:
            scales = scales_of([one.scale for one in found])
            self._warn(found)
            self._fades = self._kirchhoff and (scales is None or scales[0].grating is None)
            self._scale.update(scales, nodes, height_scale, lowest is not None)
        if beneath:
            ratios = [self._ratio(one) for one in _alike([one.albedo for one in found])]
            self._reflected.update(ratios, nodes, height_scale, lowest is not None)

    def _warn(self, found: list[Conservation]) -> None:
        """Say once that much is taken of a real material."""
        if self._warned or isinstance(self._material, Perfect) or found[0].scale is None:
            return
        albedo = found[0].albedo
        largest = float(albedo.values[:, albedo.grid.theta <= math.radians(80.0)].max())
        if largest > 1.0 + MUCH:
            self._warned = True
            warnings.warn(
                f"the surface would reflect up to {100 * largest:.0f} % of the light within 80° of "
                "the normal: what is above 100 % is taken (energy_conserving=false keeps it); its "
                "orders are least certain there",
                DiffractionWarning,
                stacklevel=2,
            )

    def brightness(self, height_scale: float) -> Array | None:
        """s for who knows no wavelengths, (polar + 1, azimuthal): their mean as the eye has it."""
        nodes = self._energy.nodes(height_scale)
        found = [self._energy.at(node) for node in nodes]
        scales = scales_of([one.scale for one in found])
        if scales is None:
            return None
        scales = [one if one.grating is None else one.on(FINE) for one in scales]
        scale = _between(scales, nodes, height_scale)
        weights = response(scale.wavelengths)[:, 1] * scale.wavelengths
        return np.average(scale.values, axis=0, weights=weights).astype(np.float32)

    def ratio(self, height_scale: float) -> DirectionalTable:
        """What `reflected` looks up, for who draws without Dr.Jit."""
        nodes = self._energy.nodes(height_scale)
        ratios = [self._ratio(self._energy.at(node).albedo) for node in nodes]
        return _between(ratios, nodes, height_scale)

    @property
    def fades(self) -> bool:
        """Whether the factor has `tables.energy.gain.fade`."""
        return self._fades

    @property
    def takes(self) -> bool:
        """Whether the BSDF is multiplied by anything."""
        return self._scale.present

    def factor(self, pair: Pair, wavenumbers: list[Float], height_scale: Float) -> Colour:
        """s(ωi) s(ωo), and for Kirchhoff's model `tables.energy.gain.fade`, per channel.

        height_scale : the one given to `update`; needed where derivatives with respect to it are,
            and where it varies.
        """
        both = zip(
            self._scale.at(pair.incident, pair.cos_i, wavenumbers, height_scale),
            self._scale.at(pair.outgoing, pair.cos_o, wavenumbers, height_scale),
            strict=True,
        )
        found = mi.UnpolarizedSpectrum([one * other for one, other in both])
        if self._fades:
            one, other = dr.minimum(pair.cos_i, GRAZING), dr.minimum(pair.cos_o, GRAZING)
            found *= dr.square(dr.minimum(one, other) * dr.rcp(dr.maximum(one, other)))
        return found

    def reflected(
        self, tangential: Vector2f, cosine: Float, wavenumbers: list[Float], height_scale: Float
    ) -> Colour:
        """a(ω) over the flat interface's reflectance, per channel; `update` was told `beneath`."""
        return mi.UnpolarizedSpectrum(
            self._reflected.at(tangential, cosine, wavenumbers, height_scale)
        )

    def _ratio(self, albedo: DirectionalTable) -> DirectionalTable:
        found = self._indices(albedo.wavelengths)
        assert found is not None  # without an index no light goes beneath
        flat = fresnel.reflectance(np.cos(albedo.grid.theta), found[:, None])
        # of an index of 1 there is neither
        ratio = np.where(flat > 1e-9, 1.0 / np.maximum(flat, 1e-9), 0.0)[:, :, None]
        values = albedo.values * ratio
        if isinstance(found, fresnel.Filmed):  # which may reflect next to nothing
            values = np.minimum(values, MOST_RATIO)
        return DirectionalTable(albedo.wavelengths, values.astype(np.float32))


class Lookup:
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
        self._nodes = upload(mi.Float, maps)
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
        if self._varies or dr.grad_enabled(height_scale):
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


def _chain(grating: Grating, tangential: Vector2f, wavenumber: Float) -> tuple[Float, Float]:
    """Row and column of a `tables.energy.grating.GratingGrid`."""
    cosine, sine = grating.axis
    x = cosine * tangential.x + sine * tangential.y
    y = cosine * tangential.y - sine * tangential.x
    width, per_x = dr.safe_sqrt(dr.fma(-y, y, 1.0)), wavenumber / grating.spacing
    rows = []
    for one in (width - x, width + x):
        xi = dr.maximum(one * per_x, 0.0)
        whole = dr.floor(xi)
        rest = xi - whole
        within = dr.sqrt(rest / LAST_NODE) * (NODES - ENDS)
        beyond = (rest - LAST_NODE) * (ENDS / (1.0 - LAST_NODE)) + (NODES - ENDS)
        rows.append(dr.fma(whole, NODES, dr.select(rest < LAST_NODE, within, beyond)))
    return rows[0], rows[1]


def indices_of(
    material: Reflectance | Inside | UnderFilm, wavelengths: NDArray[np.float64]
) -> Indices | None:
    """n + ik of a material at wavelengths (n,), nm, in the variant's colours; None for R = 1."""
    if isinstance(material, Perfect):
        return None
    if isinstance(material, UnderFilm):
        index = indices_of(material.material, wavelengths)
        assert isinstance(index, np.ndarray)
        film, thickness = material.numbers()
        rounded = _rounded(thickness, THICKNESS_STEP)
        return fresnel.Filmed(index, film, 2.0 * np.pi * rounded / wavelengths)
    found = []
    for wavelength in wavelengths if mi.is_spectral else wavelengths[:1]:
        si = dr.zeros(mi.SurfaceInteraction3f)
        if mi.is_spectral:
            si.wavelengths = mi.UnpolarizedSpectrum(float(wavelength))
        channels = [_complex(n) for n in material.indices(si, True)]
        found.append(channels[0] if not mi.is_rgb else channels)
    if not mi.is_rgb:
        return np.broadcast_to(np.array(found), wavelengths.shape)
    colours = np.broadcast_to(np.array(found[0]), len(RGB_WAVELENGTHS))
    return np.interp(wavelengths, RGB_WAVELENGTHS[::-1], colours[::-1])


def _rounded(value: ArrayLike, step: float) -> NDArray[Any]:
    return np.asarray(np.round(np.asarray(value) / step) * step)


def _rounded_indices(
    material: Reflectance | Inside | UnderFilm, wavelengths: NDArray[np.float64]
) -> Indices | None:
    """`indices_of`, to `INDEX_STEP`: an optimisation of them waits rarely, and sees s and the ratio
    of albedos as constants.
    """
    found = indices_of(material, wavelengths)
    if found is None:
        return None
    if isinstance(found, fresnel.Filmed):
        index, film, depth = found.parts
        return fresnel.Filmed(_rounded(index, INDEX_STEP), _rounded(film, INDEX_STEP), depth)
    return _rounded(found, INDEX_STEP)


def _complex(number: Float) -> complex:
    if dr.is_complex_v(number):
        return complex(plain(number.real), plain(number.imag))
    return complex(plain(number))


def scales_of(found: Sequence[DirectionalTable | None]) -> list[DirectionalTable] | None:
    """s of each, 1 where there is none; nothing if there is none at all."""
    made = next((one for one in found if one is not None), None)
    if made is None:
        return None
    ones = replace(made, values=np.ones_like(made.values))
    return [one or ones for one in found]


def _between(
    tables: list[DirectionalTable], nodes: tuple[float, float], height_scale: float
) -> DirectionalTable:
    """Interpolated between two height scales."""
    low, high = _alike(tables)
    width = nodes[1] - nodes[0]
    share = np.float32((height_scale - nodes[0]) / width if width > 0.0 else 0.0)
    return DirectionalTable(low.wavelengths, low.values * (1 - share) + high.values * share)


def _alike(tables: list[DirectionalTable]) -> list[DirectionalTable]:
    """Albedos, all on the directions and wavelengths of the finest."""
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
