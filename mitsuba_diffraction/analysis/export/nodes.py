"""Light of a surface laid on the nodes of a file: what a reader integrates is the surface's light.

A reader interpolates between nodes linearly, so a node stands for a hat function of directions.
Light that leaves in some direction is shared between the four nodes around it, and a node's value
is its light over ∫ hat cosθ dω: the integral of the interpolated file is the light laid on it,
order by order, however coarse the nodes are.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.sparse import csr_array
from scipy.special import ndtri

from ...arrays import Real
from ...errors import DiffractionError
from ...llvm import require_loaded_llvm
from ...optics.geometry import wavenumber
from ...orders import OrderTable, lookup_in
from ...orders.listing import orders_of
from ...orders.lookup import Arrays
from ...plugin.description import VARYING, Consumer, Feature, Surface
from ...plugin.memory import upload
from ...progress import Progress
from ..known_wavelengths import check_lit
from ..maps.evaluate import opaque
from ..maps.hemisphere import flat_interaction, polar, sub_samples, vectors

#: Files hold the reflected light of one place.
FILES = Consumer(
    "a file of a BRDF",
    frozenset(Feature) - VARYING - {Feature.TRANSMISSION},
    "give a surface that only reflects, with numbers in place of textures",
)
#: Values in a file at most, about a gigabyte.
MOST = 1 << 28
#: Pairs of directions of a kernel launch.
_LAUNCH = 1 << 20
#: Outgoing directions at which one light is evaluated, at most.
_MOST_SAMPLES = 1 << 23
#: Directions and wavelengths at which an order's lobe is laid on nodes.
_LOBE_SAMPLES = 256
#: Least number of samples between neighbouring nodes along p, along q, and along q from a pole,
#: for ∫ hat cosθ dω within 0.1 %.
_LEAST = 4, 8, 32
#: Samples along q for one elsewhere, where azimuths meet: half of a lobe there ends in the middle,
#: and even samples of x exp(−x²) are off by a twelfth of their distance squared.
_FINER = 8
#: Angle from the normal, rad, that stands for 0: φ still turns the axes of a file there.
_LEAST_THETA = 1e-9
#: Steepest light, degrees.
STEEPEST = 89.0
# Fractions of a two-dimensional sequence of low discrepancy (Roberts 2018, "R2")
_R2 = 0.7548776662466927, 0.5698402909980532


class ExportGrid(NamedTuple):
    """Directions to the light, and wavelengths, of a file.

    Attributes
    ----------
    theta, phi : degrees from the normal, and from x towards y; rising.
    wavelengths : nm, rising.
    resolution : number of nodes of outgoing directions, as each format has them.
    """

    theta: Real
    phi: Real
    wavelengths: Real
    resolution: int

    def checked(self, values: int) -> ExportGrid:
        """Return the grid; refuse angles that are out of range, and too large files.

        values : in the file, for each direction to the light and wavelength.
        """
        for name, axis, low, high in (
            ("theta", self.theta, 0.0, STEEPEST), ("phi", self.phi, -360.0, 360.0),
            ("wavelength", self.wavelengths, 100.0, 20_000.0),
        ):  # fmt: skip
            rises = axis.size > 0 and bool(np.all(np.diff(axis) > 0.0))
            if not (rises and low <= axis[0] and axis[-1] <= high):
                raise DiffractionError(
                    f"{name}: expected rising numbers from {low:g} to {high:g}, got "
                    f"{', '.join(f'{value:g}' for value in axis[:5]) or 'none'}"
                )
        total = self.theta.size * self.phi.size * self.wavelengths.size * values
        if total > MOST:
            raise DiffractionError(
                f"{total:.2g} values are over {MOST:.2g}; lower the resolution, or take fewer "
                "directions or wavelengths"
            )
        return self


@dataclass(frozen=True, eq=False)
class Nodes:
    """Nodes of outgoing directions: even azimuths around the circle, by even polar coordinates.

    Attributes
    ----------
    azimuths : number of azimuths p, from 0 to below 2π.
    polar : nodes (m,) of the other coordinate q, rising.
    ends : q between which there are directions; beyond the nodes the nearest one's value holds.
    directions : function of ωi (3,), p and q that returns unit vectors ωo (n, 3) and dω/(dp dq).
    place : function of ωi and ωo that returns p and q.
    spread : function of q that returns rad of ωo per unit of p and of q, at most.
    deviation : function of q that returns rad of ωo from the mirror direction; None where q does
        not tell.
    pole : whether the first q is one direction for all azimuths.
    cosine : whether values are f cosθo, in place of f.
    """

    azimuths: int
    polar: Real
    ends: tuple[float, float]
    directions: Callable[[Real, Real, Real], tuple[Real, Real]]
    place: Callable[[Real, Real], tuple[Real, Real]]
    spread: Callable[[float], tuple[float, float]]
    deviation: Callable[[float], float] | None = None
    pole: bool = False
    cosine: bool = False

    @property
    def count(self) -> int:
        """Number of nodes."""
        return self.azimuths * len(self.polar)

    @property
    def size(self) -> float:
        """Largest distance between neighbours, rad."""
        sizes = [self.spread(q) for q in self.polar]
        step = float(self.polar[1] - self.polar[0])
        return max(max(p * 2.0 * np.pi / self.azimuths, q * step) for p, q in sizes)

    def hats(self, p: Real, q: Real) -> csr_array:
        """Return the hat functions at some directions, (nodes, n); a pole is its first node."""
        last = len(self.polar) - 1
        across = p * (self.azimuths / (2.0 * np.pi))
        along = np.clip((q - self.polar[0]) / (self.polar[1] - self.polar[0]), 0.0, last)
        i, j = np.floor(across), np.minimum(np.floor(along), last - 1)
        shares = [(i, 1.0 - across + i), (i + 1, across - i)]
        others = [(j, 1.0 - along + j), (j + 1, along - j)]
        rows, weights = [], []
        for (a, share), (b, other) in itertools.product(shares, others):
            azimuth = np.where((b == 0) & self.pole, 0, a % self.azimuths)
            rows.append((azimuth * (last + 1) + b).astype(np.int64))
            weights.append(share * other)
        columns = np.tile(np.arange(len(p)), 4)
        entries = np.concatenate(weights), (np.concatenate(rows), columns)
        return csr_array(entries, shape=(self.count, len(p)))

    def lattice(self, step: float, others: float, reach: float) -> tuple[Real, Real, Real, Real]:
        """Return p and q at the middles of even parts, their areas, and numbers of 0 to 1.

        The numbers are even over any part of the lattice.

        step, others : largest distance of samples up to `reach` from the mirror direction, and
            beyond, rad.
        """
        low, high = self.ends
        edges = [low, *self.polar[(self.polar > low) & (self.polar < high)].tolist(), high]
        parts = []
        for first, last in itertools.pairwise(edges):
            beyond = self.deviation is not None and self.deviation(first) > reach
            across, along = self.spread(last)
            meet = first == low and self.spread(low)[0] == 0.0
            along *= _FINER if meet else 1
            least = _LEAST[2 if meet else 1]
            size = others if beyond else step
            m = max(math.ceil(across * 2.0 * np.pi / self.azimuths / size), _LEAST[0])
            m, n = m * self.azimuths, max(math.ceil(along * (last - first) / size), least)
            i, j = (part.ravel() for part in np.meshgrid(np.arange(m), np.arange(n), indexing="ij"))
            widths = 2.0 * np.pi / m, (last - first) / n
            parts.append((
                (i + 0.5) * widths[0], first + (j + 0.5) * widths[1],
                np.full(m * n, widths[0] * widths[1]), (i * _R2[0] + j * _R2[1]) % 1.0,
            ))  # fmt: skip
        p, q, area, number = (np.concatenate(column) for column in zip(*parts, strict=True))
        return p, q, area, number


class Laid(NamedTuple):
    """Light of one direction on the nodes of a file.

    Attributes
    ----------
    values : (azimuths, polar, wavelengths), f in 1/sr, or f cosθo.
    light : of the same shape, share of the incident light at each node; its sum is reflected.
    weights : (azimuths, polar), sr, ∫ cosθo dω about each node: `light` is f times it.
    """

    values: Real
    light: Real
    weights: Real


def laid(
    bsdf: Any, nodes: Nodes, grid: ExportGrid, lights: Real, progress: Progress
) -> Iterator[Laid]:
    """Yield a surface's light on nodes, for each direction to the light (n, 3).

    Lobes are integrated as they are rendered. A table of orders whose lobes are narrower than the
    nodes has its efficiencies laid there, order by order, so that no light is lost beyond the
    horizon. Where there are several wavelengths, a band around each is averaged, as wide as the
    mean of its distances to both neighbours.

    Raises a DiffractionError if the variant cannot be evaluated, the surface transmits or varies,
    its table has no light of a wavelength, or its lobes are too narrow to be integrated.
    """
    if not mi.is_spectral or mi.is_polarized or "scalar" in mi.variant():
        raise DiffractionError(
            f"variant '{mi.variant()}' does not support files of a BRDF; use llvm_ad_spectral or "
            "cuda_ad_spectral"
        )
    require_loaded_llvm()
    surface = FILES.described(bsdf)
    check_lit(surface, grid.wavelengths, grid.theta, grid.phi)
    shortest, longest = (float(wavenumber(grid.wavelengths[n])) for n in (0, -1))
    lobe = 1.0 / (math.sqrt(2.0) * surface.sigma * shortest)
    solved = surface.solved and surface.nested is None and lobe < 0.5 * nodes.size
    # order 0 has the narrowest lobe; lobes of other orders are as wide as a scan's windows
    wider = 1.0 if surface.solved else surface.coherence_width / surface.patch.window_width
    step = math.inf if solved else math.sqrt(2.0) * lobe
    # 4e-6 of a lobe is beyond five deviations, which are 1/cosθ times as long in the plane of light
    reach = 5.0 * lobe * shortest / longest / math.cos(math.radians(grid.theta[-1]))
    p, q, area, number = nodes.lattice(step, wider * step, reach)
    if len(p) > _MOST_SAMPLES:
        raise DiffractionError(
            f"coherence_width={surface.coherence_width:g} µm: lobes of {np.degrees(lobe):.2g}° are "
            f"too narrow to be integrated at {len(p):.2g} directions; export the surface with a "
            "narrower one, whose lobes are still narrower than the file's nodes"
        )
    hats = nodes.hats(p, q)
    bands = np.gradient(grid.wavelengths) if len(grid.wavelengths) > 1 else np.zeros(1)
    orders = _Orders(surface) if solved else None
    together = 1 if solved else max(_LAUNCH // len(p), 1)
    for first in range(0, len(lights), together):
        progress(first, len(lights), "evaluating")
        group = lights[first : first + together]
        wo, widths = zip(*(nodes.directions(wi, p, q) for wi in group), strict=True)
        solid = [area * part * (out[:, 2] > 0.0) for part, out in zip(widths, wo, strict=True)]
        if orders is not None:
            light = [orders.on(nodes, wi, grid.wavelengths, bands) for wi in group]
        else:
            lit = np.concatenate(solid) > 0.0
            shift = np.tile(number, len(group))[lit] - 0.5
            pairs = np.repeat(group, len(p), axis=0)[lit], np.concatenate(wo)[lit]
            values = np.zeros((len(lit), len(grid.wavelengths)))
            values[lit] = _evaluated(bsdf, *pairs, grid.wavelengths, bands, shift)
            parts = zip(np.split(values, len(group)), solid, strict=True)
            light = [hats @ (part * areas[:, None]) for part, areas in parts]
        for part, areas, out in zip(light, solid, wo, strict=True):
            yield _values(nodes, part, hats @ (areas if nodes.cosine else areas * out[:, 2]))
    progress(1, 1, "evaluating")


def _values(nodes: Nodes, light: Real, weight: Real) -> Laid:
    """Return light (nodes, wavelengths) over ∫ hat cosθ dω (nodes,), 0 below the horizon."""
    known = weight > 0.0
    values = np.where(known[:, None], light, 0.0) / np.where(known, weight, 1.0)[:, None]
    shape = nodes.azimuths, len(nodes.polar), -1
    values, light = values.reshape(shape), light.reshape(shape)
    if nodes.pole:
        values[:, 0], light[:, 0] = values[0, 0], light[0, 0] / nodes.azimuths
    return Laid(values, light, weight.reshape(shape[:2]))


def light_vectors(grid: ExportGrid) -> Real:
    """Return the directions to the light of a grid, (n, 3), φ outermost; none is quite normal."""
    phi, theta = np.meshgrid(np.radians(grid.phi), np.radians(grid.theta), indexing="ij")
    return polar(np.maximum(theta, _LEAST_THETA).ravel(), phi.ravel())


def _evaluated(bsdf: Any, wi: Real, wo: Real, wavelengths: Real, bands: Real, shift: Real) -> Real:
    """Return f cosθo of pairs (n, 3), each at its shift from the wavelengths (w,), (n, w).

    bands : (w,) widths of bands, nm; shift : (n,) in widths of the band.
    """
    towards, out = vectors(wi), vectors(wo)
    si = flat_interaction(towards, len(wo))
    shifts, packet = upload(mi.Float, shift.astype(np.float32)), len(mi.UnpolarizedSpectrum())
    result = np.empty((len(wo), len(wavelengths)))
    for first in range(0, len(wavelengths), packet):
        part = wavelengths[first : first + packet]
        middle, band = (
            mi.UnpolarizedSpectrum(opaque(np.resize(each[first : first + packet], packet)))
            for each in (wavelengths, bands)
        )
        si.wavelengths = middle + band * shifts
        values = bsdf.eval(mi.BSDFContext(), si, out)
        dr.eval(values)
        for column, channel in zip(range(len(part)), values, strict=False):
            result[:, first + column] = np.array(channel)
    return result


class _Orders:
    """Orders of a table at the centres of their lobes, spread by the lobe."""

    def __init__(self, surface: Surface) -> None:
        self._table: OrderTable = surface.orders
        self._sigma = surface.sigma
        si = flat_interaction(mi.Vector3f(0.0, 0.0, 1.0), 1)
        turn = [float(np.array(part).ravel()[0]) for part in surface.frame(si)[:2]]
        self._turn = np.array([[turn[0], turn[1]], [-turn[1], turn[0]]])  # shading frame to patch
        self._lookup = lookup_in(self._table, Arrays, coated=True, elements=False)

    def on(self, nodes: Nodes, wi: Real, wavelengths: Real, bands: Real) -> Real:
        """Return the light of one direction on nodes, (nodes, wavelengths)."""
        pattern = sub_samples(_LOBE_SAMPLES)
        spread = ndtri(pattern[:, :2]) / (math.sqrt(2.0) * self._sigma)
        x, y = self._turn @ wi[:2]
        light = np.zeros((nodes.count, len(wavelengths)))
        for column, (middle, band) in enumerate(zip(wavelengths, bands, strict=True)):
            lam = middle + band * (pattern[:, 2] - 0.5)
            every = orders_of(self._table, float(lam.min()))
            m, waves = every[:, None, :], lam[None, :]
            shifts = [m[..., k] * waves / (1e3 * d) for k, d in enumerate(self._table.periods)]
            centre = np.stack([shifts[0] - x, shifts[1] - y], axis=-1)
            leaves = (centre**2).sum(axis=-1) < 1.0
            m, waves = (np.broadcast_to(part, (*leaves.shape, *part.shape[2:]))[leaves]
                        for part in (m, waves))  # fmt: skip
            flat = np.zeros(len(waves))
            row: Any = self._lookup.row(flat + x, flat + y, flat + wi[2], waves)
            order: Any = tuple(m.T.astype(float)) if self._table.crossed else m[:, 0].astype(float)
            share = self._lookup.share(row, order, flat == 0.0).efficiency / _LOBE_SAMPLES
            kernel = np.broadcast_to(spread / wavenumber(lam)[:, None], centre.shape)[leaves]
            middle_of = centre[leaves]
            across = middle_of + kernel
            # light that would leave below the horizon stays at the lobe's centre
            below = (across**2).sum(axis=-1) >= 1.0
            across[below] = middle_of[below]
            across = across @ self._turn
            z = np.sqrt(np.maximum(1.0 - (across**2).sum(axis=-1), 0.0))
            p, q = nodes.place(wi, np.column_stack([across, z]))
            light[:, column] = nodes.hats(p, q) @ share
        return light
