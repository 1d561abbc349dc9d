"""Colour tables: diffraction summed over all wavelengths of daylight, for renderers without them.

With s̄(λ) the daylight's response of the eye in linear sRGB (∫s̄ = white), z = w·height_scale and
⟨|P|²⟩ the window's power,

    RGB(u, v, z) = ∫ ⟨|P|²⟩(2πu/λ, 2πv/λ; 2πz/λ) / (4π²σ⁴) · s̄(λ)/λ² dλ

holds all that depends on the wavelength. A perfect mirror's albedo is (1, 1, 1). Colours outside
the display's gamut are negative in one channel: they stay so, since clipping would brighten sums.

Order 0, a thousand times brighter than the rest, is the same in all azimuths: a small table of its
own over radius and z, in single precision. All other orders are on a polar grid, as a piecewise
Chebyshev series in z, in half floats.
"""

from __future__ import annotations

import math
import weakref
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...digests import key_of
from ...errors import warn
from ...optics.colour import delta_e, linear_srgb, response
from ..build.coefficients import half_scale
from ..expansion import Expansion
from ..powers import series_kind
from ..store import Record, cached
from ..table import DiffractionTable
from .build import VISIBLE, OtherOrders, PolarGrid, lobe_of, order_0_colour

#: Raised whenever the same diffraction table would make another colour table.
COLOUR_VERSION = 2
#: Largest table of colours, bytes.
MAX_BYTES = 64_000_000
#: Terms of the series, three colours of them and one number of padding are 16 half floats.
TERMS = 5
#: Half floats of one bin and interval.
PACKET = 16
#: Distance of rings in ln r, and of azimuths in standard deviations of the narrowest lobes.
STEP, SHARE = 0.02, 0.75

_SERIES = 8e-3  # relative error of the series in z, at the worst z
_COARSE = 1.6  # beyond this distance of azimuths, peaks are a quarter too low
_RADII = 256  # of order 0
_NUMBERS = ("scale", "radius_end", "sigma", "sigma_0")


@dataclass(frozen=True, eq=False, repr=False)
class ColourTable:
    """Linear sRGB of the diffracted light per direction, see above.

    Attributes
    ----------
    grid : where the bins are.
    expansion : the series in z, "kappa" being z.
    coefficients : (intervals, bins, 16) float16: term t of colour c is number c·TERMS + t; divided
        by `scale` before use.
    scale : see there.
    order_0 : (radii, zs, 4) float32, the last number being 0; even from 0 to `radius_end` and
        from 0 to the largest z.
    radius_end : where order 0 ends.
    sigma, sigma_0 : σ of the window of all orders but 0, and σ₀ of order 0's, µm.
    """

    grid: PolarGrid
    expansion: Expansion
    coefficients: NDArray[np.float16]
    scale: float
    order_0: NDArray[np.float32]
    radius_end: float
    sigma: float
    sigma_0: float

    @classmethod
    def build(cls, table: DiffractionTable) -> ColourTable:
        """Sum a diffraction table over wavelengths."""
        table.require_whole("colours for RGB variants are summed from")
        z_max = 2.0 * table.height_scale_max
        grid = PolarGrid.of(lobe_of(table), STEP, SHARE)
        orders = OtherOrders(table)
        expansion = _expansion(table, orders, grid, z_max)
        grid = _fitting(table, grid, expansion)
        values = np.zeros((expansion.intervals, grid.bins, PACKET), np.float32)
        for band in grid.bands():
            everywhere = np.arange(grid.counts[band.start])
            for ring, azimuths, block in orders.blocks(grid, band, everywhere, expansion):
                bins = grid.start(ring) + azimuths
                flat = block.reshape(len(bins), expansion.intervals, -1)
                values[:, bins, : 3 * TERMS] = flat.transpose(1, 0, 2)
        for ring in range(grid.rings):
            start = grid.start(ring)
            values[:, start + grid.counts[ring]] = values[:, start]
        largest = float(np.abs(values).max())
        scale = half_scale(largest)
        values *= np.float32(scale)
        radius_end = 4.5 * VISIBLE[1] * 1e-3 / (2 * math.pi * table.sigma_0)
        # Neighbouring z differ by at most a tenth in the phase of the deepest parts
        zs = 2 + math.ceil(10.0 * z_max * 4 * math.pi / 0.44 * table.expansion.half_range)
        return cls(
            grid=grid,
            expansion=expansion,
            coefficients=values.astype(np.float16),
            scale=scale,
            order_0=order_0_colour(
                table, np.linspace(0.0, radius_end, _RADII), np.linspace(0.0, z_max, min(zs, 4096))
            ),
            radius_end=radius_end,
            sigma=table.sigma,
            sigma_0=table.sigma_0,
        )

    def to_record(self) -> Record:
        """Return the record of the table for the cache."""
        document = {name: asdict(getattr(self, name)) for name in ("grid", "expansion")}
        document |= {name: getattr(self, name) for name in _NUMBERS}
        return Record(document, [self.coefficients, self.order_0])

    @classmethod
    def from_record(cls, record: Record) -> ColourTable:
        """Return the table of such a record."""
        document, (coefficients, order_0) = record.document, record.arrays
        grid = document["grid"]
        return cls(
            grid=PolarGrid(grid["smallest"], grid["step"], tuple(grid["counts"])),
            expansion=Expansion(**document["expansion"]),
            coefficients=coefficients,
            order_0=order_0,
            **{name: document[name] for name in _NUMBERS},
        )

    @property
    def nbytes(self) -> int:
        """Size in memory."""
        return self.coefficients.nbytes + self.order_0.nbytes

    @property
    def z_max(self) -> float:
        """Largest w·height_scale."""
        return self.expansion.kappa_max

    def colour(self, u: ArrayLike, v: ArrayLike, z: ArrayLike) -> NDArray[np.float64]:
        """RGB (n, 3) in 1/µm² at u, v, z, each (n,), as `plugin.rgb.RGBPower`."""
        u, v, z = (np.atleast_1d(np.asarray(a, float)) for a in (u, v, z))
        radius, turn = np.hypot(u, v), np.arctan2(v, u) / (2 * np.pi) % 1.0
        grid = self.grid
        lowest = np.log(np.maximum(radius, grid.smallest) / grid.smallest) / grid.step
        lowest = np.clip(lowest, 0.0, grid.rings - 1.001)
        interval = self.expansion.interval(z)
        starts = np.array([grid.start(n) for n in range(grid.rings)])
        packet = np.zeros((len(u), PACKET))
        for ring, share in _pair(lowest):
            position = turn * np.array(grid.counts)[ring]
            for azimuth, of_azimuth in _pair(position):
                node = self.coefficients[interval, starts[ring] + azimuth]
                packet += (share * of_azimuth)[:, None] * node
        series = packet[:, : 3 * TERMS].reshape(-1, 3, TERMS) / self.scale
        result = np.einsum("nct,nt->nc", series, self.expansion.weights(z))
        radii, zs = self.order_0.shape[:2]
        at_radius = np.minimum(radius / self.radius_end * (radii - 1), radii - 1.001)
        for n, share in _pair(at_radius):
            for m, of_z in _pair(np.clip(z / self.z_max, 0.0, 1.0) * (zs - 1.001)):
                result += (share * of_z * (radius < self.radius_end))[:, None] * self.order_0[n, m][
                    :, :3
                ]
        return result

    def __repr__(self) -> str:
        return (
            f"ColourTable({self.grid.rings} rings, up to {max(self.grid.counts)} azimuths, "
            f"{self.expansion.intervals}×{TERMS} terms, {self.nbytes / 1e6:.1f} MB)"
        )


def _pair(
    position: NDArray[np.float64],
) -> list[tuple[NDArray[np.int64], NDArray[np.float64]]]:
    """The two whole numbers around a position, and their weights."""
    lower = np.floor(position).astype(np.int64)
    upper = position - lower
    return [(lower, 1.0 - upper), (lower + 1, upper)]


def _expansion(
    table: DiffractionTable, orders: OtherOrders, grid: PolarGrid, z_max: float
) -> Expansion:
    """Return the fewest intervals of z that meet the tolerance on a few azimuths of a few rings."""
    bands = [band for band in grid.bands() if 0.1 < grid.radius(band.start) < 1.0]

    def expand(terms: int, intervals: int) -> tuple[Expansion, NDArray[np.float64]]:
        half = table.expansion.half_range
        expansion = Expansion("chebyshev", series_kind(table), terms, intervals, z_max, half)
        blocks = []
        for band in bands:
            azimuths = np.linspace(0, grid.counts[band.start], 33)[:-1].astype(np.int64)
            rings = range(band.start, min(band.start + 4, band.stop))
            blocks += [block for *_, block in orders.blocks(grid, rings, azimuths, expansion)]
        return expansion, np.concatenate(blocks).astype(float)

    z = z_max * (np.arange(200) + 0.5) / 200

    def evaluate(series: tuple[Expansion, NDArray[np.float64]]) -> NDArray[np.float64]:
        expansion, coefficients = series
        return np.einsum(
            "azct,zt->azc",
            coefficients[:, expansion.interval(z)],
            expansion.weights(z),
            optimize=True,
        )

    phase = z_max * 2 * math.pi / 0.44 * table.expansion.half_range
    exact = evaluate(expand(16, max(1, math.ceil(phase / 5.0))))
    total = np.abs(exact).sum(axis=(0, 2))  # of each z; where a grating goes dark, not itself
    total = np.maximum(total, 0.05 * total.max())
    intervals = max(1, math.ceil(phase / 6.0))
    while True:
        series = expand(TERMS, intervals)
        error = np.abs(evaluate(series) - exact).sum(axis=(0, 2))
        # Half an interval of 1.3 radians is exact to a thousandth for any surface
        if np.all(error <= _SERIES * total) or intervals >= phase / 1.3:
            return series[0]
        intervals = max(intervals + 1, round(intervals * 1.15))


def _fitting(table: DiffractionTable, grid: PolarGrid, expansion: Expansion) -> PolarGrid:
    """The grid, or a coarser one if the table would be larger than `MAX_BYTES`."""
    share, step = SHARE, STEP
    while grid.bins * expansion.intervals * PACKET * 2 > MAX_BYTES - 4_000_000:
        share, step = share * 1.1, min(step * 1.05, 2 * STEP)
        grid = PolarGrid.of(lobe_of(table), step, share)
    if share > _COARSE:
        warn(
            f"in RGB variants the colours of {table.source.get('name', 'this surface')} are "
            f"blurred: it is so deep, or its coherence window so wide, that azimuths are "
            f"{share:.1f} lobes apart in {MAX_BYTES / 1e6:.0f} MB; use a spectral variant"
        )
    return grid


_PAIRS = 1500  # of directions; the mean of their ΔE is known to some per cent
_STEP = 2.0  # nm


def colour_difference(table: ColourTable, other: ColourTable) -> NDArray[np.float64]:
    """ΔE2000 (n,) between two colour tables, over random pairs of directions."""
    u, v, z, factor = _pairs()
    return _loss(table.colour(u, v, z), other.colour(u, v, z), factor)


def power_colour_difference(
    table: DiffractionTable, other: DiffractionTable
) -> NDArray[np.float64]:
    """ΔE2000 (n,) between two tables of powers, summed over daylight's wavelengths."""
    u, v, z, factor = _pairs()
    lam = np.arange(*VISIBLE, _STEP)[:, None]
    weights = linear_srgb(response(lam[:, 0])) / lam**2
    k = 2e3 * np.pi / lam
    exact, colours = (t.window_sum(k * u, k * v, k * z).T @ weights for t in (table, other))
    return _loss(exact, colours, factor)


def _pairs() -> tuple[NDArray[np.float64], ...]:
    """u, v, z of random pairs of directions away from the specular one, and w² to divide by.

    Half of them in the planes of the axes, out of which gratings with one period send nothing.
    """
    rng = np.random.default_rng(2)
    radius, turn = (
        np.sqrt(rng.uniform(0, 0.95, (2, _PAIRS))),
        rng.uniform(0, 2 * np.pi, (2, _PAIRS)),
    )
    x, y = radius * np.cos(turn), radius * np.sin(turn)
    z = np.sqrt(1.0 - radius**2)
    u, v = x.sum(axis=0), y.sum(axis=0)
    u[::4] = v[1::4] = 0.0
    return u, v, z.sum(axis=0), z.sum(axis=0) ** -2 / z[0]


def _loss(
    exact: NDArray[np.float64], other: NDArray[np.float64], factor: NDArray[np.float64]
) -> NDArray[np.float64]:
    first, second = exact * factor[:, None], other * factor[:, None]
    # smooth grooves leave most directions darker than a picture shows beside their orders
    brightness = first.max(axis=1)
    white = max(float(np.percentile(brightness, 95.0)), float(brightness.mean()))
    difference = delta_e(first, second, exposure=1.0 / white if white > 0.0 else None)
    return difference[np.isfinite(difference)]


_colours: weakref.WeakKeyDictionary[DiffractionTable, dict[str, ColourTable]] = (
    weakref.WeakKeyDictionary()
)


def cached_colours(table: DiffractionTable) -> ColourTable:
    """Return the colours of a table, from memory, from disk, or summed and stored."""
    key, memory = key_of(COLOUR_VERSION, table.digest()), _colours.setdefault(table, {})
    both_ways = ColourTable.to_record, ColourTable.from_record
    return cached("colours", key, memory, lambda: ColourTable.build(table), *both_ways)
