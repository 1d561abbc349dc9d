"""Table of the orders of a periodic profile, solved or listed rather than modelled."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from . import cells
from .cells import Array, B, Counts, largest_band

#: Sum over all orders that a table may have: 1, but for a solver's error.
LARGEST_SUM = 1.001
#: Largest excess of an element of a Mueller matrix over its efficiency: single precision, and
#: sums above 1 that were scaled.
ROUNDING = 2e-3
#: Wavelengths in vacuum, nm, and periods, µm, that a table may have.
WAVELENGTHS, PERIODS = (100.0, 20_000.0), (0.01, 1000.0)
#: Least index of a block: orders of light that goes through depend on n − 1.
LEAST_BLOCK = 1.01
#: Octaves beyond its wavelengths within which a table has its nearest efficiencies, and then none.
MARGIN = 0.1
#: Bands, and nodes along an axis, of a table at most: beyond, no renderer would want it.
MOST_BANDS, MOST_NODES = 256, 64
#: Numbers of elements of Mueller matrices that a response may have.
UNPOLARISED, ALONG, LINEAR, MUELLER = 1, 2, 3, 16


@dataclass(frozen=True, eq=False, repr=False)
class Band:
    """Response of the directions whose K has the same whole part k (`cells`).

    Attributes
    ----------
    k : the band.
    a : (τ, ρ, w, k + 1, k + 1, n) float32, kind A: the first n elements of the Mueller matrices,
        row by row, from the light incident through channel j (fourth axis) to channel q (fifth).
        A sheet or a block has ports instead of channels, twice as many.
    b : (τ, ρ, w, k, k, n) of kind B, with the same nodes; None for k = 0.
    """

    k: int
    a: NDArray[np.float32]
    b: NDArray[np.float32] | None = None

    @property
    def counts(self) -> Counts:
        """Numbers of nodes."""
        return Counts(*self.a.shape[:3])

    def kind(self, kind: int) -> NDArray[np.float32]:
        """Return the response of a kind, `cells.A` or `cells.B`.

        Raises a DiffractionError for kind B of band 0, which has no directions.
        """
        if kind == B and self.b is None:
            raise DiffractionError("kind B of band 0 has no propagating order; ask for kind A")
        return self.kinds[kind]

    @property
    def kinds(self) -> tuple[NDArray[np.float32], ...]:
        """Responses of kind A and, but for band 0, of kind B."""
        return (self.a,) if self.b is None else (self.a, self.b)


@dataclass(frozen=True, eq=False, repr=False)
class CellResponse:
    """Response at nodes of the cells of all directions and wavelengths (`cells`).

    Attributes
    ----------
    bands : of k = 0, 1, …, `cells.largest_band`.
    even : whether nodes are even, with linear interpolation between them; else Chebyshev nodes.
    """

    bands: tuple[Band, ...]
    even: bool = False

    @property
    def elements(self) -> int:
        """Number n of elements: 1 unpolarised, 2 of light along the grooves, 16 polarised."""
        return int(self.bands[0].a.shape[-1])

    @property
    def arrays(self) -> list[NDArray[np.float32]]:
        """All numbers."""
        return [kind for band in self.bands for kind in band.kinds]

    def nodes(self, k: int) -> tuple[Array, Array, Array]:
        """Return the nodes τ, ρ and w of a band."""
        along = cells.even_nodes if self.even else cells.nodes
        tau, rho, w = map(along, self.bands[k].counts)
        return tau, rho, w

    @property
    def layout(self) -> str:
        """Size, for people."""
        sizes = sorted({" x ".join(map(str, band.counts)) for band in self.bands})
        return f"{len(self.bands)} bands of {', '.join(sizes)} nodes"

    def check(self, table: OrderTable) -> None:
        """Raise a DiffractionError if sizes do not fit a table, or numbers are no efficiencies."""
        expected = table.last_band + 1
        if [band.k for band in self.bands] != list(range(expected)):
            raise DiffractionError(
                f"{len(self.bands)} bands of orders, expected {expected}, k = 0 to {expected - 1}: "
                f"period {table.period:g} µm at {table.wavelengths[0]:g} nm and index "
                f"{table.block or table.superstrate:g}"
            )
        for band in self.bands:
            _check_band(band, table.sides, self.elements)


@dataclass(frozen=True, eq=False, repr=False)
class ListedResponse:
    """Response at listed lights: a grid of wavelengths and directions of its own.

    Each listed light has its listed efficiencies; between them they are interpolated linearly. At
    θ = 0 all φ are one light. Elements belong to light whose mirror direction has y ≥ 0, of which
    other light on grooves is the mirror image; on crossed gratings φ covers the circle.

    Attributes
    ----------
    axes : ascending: wavelengths in vacuum, nm; then θ and φ of ωi, degrees within the medium that
        the light comes from; φ is 0 to 180 on grooves, and below 360 on crossed gratings.
    orders : (m, 2) ascending, m_x and m_y: all between the first and the last, m_x innermost.
    values : (λ, θ, φ, sides, ports, n) float32, from the side that the light comes from to the
        ports: all orders on the first side (above; of a block within), then all on the second one.
        The first n elements of Mueller matrices: 1 unpolarised, 3 of s and p, 16 polarised. Orders
        that do not propagate have a neighbour's.
    in_plane : whether all light lies in the plane across the grooves: other light then has the
        efficiencies of the light of the same K and s (`cells`), as with perfect conductors.
    """

    axes: tuple[Array, Array, Array]
    orders: NDArray[np.int64]
    values: NDArray[np.float32]
    in_plane: bool = False

    @property
    def elements(self) -> int:
        """Number n of elements."""
        return int(self.values.shape[-1])

    @property
    def arrays(self) -> list[NDArray[np.float32]]:
        """All numbers."""
        return [self.values]

    @property
    def layout(self) -> str:
        """Size, for people."""
        waves, theta, phi = map(len, self.axes)
        return f"{waves} wavelengths x {theta} theta x {phi} phi, {len(self.orders)} orders"

    def check(self, table: OrderTable) -> None:
        """Raise a DiffractionError if sizes do not fit a table, or numbers are no efficiencies."""
        sides, count = table.sides, len(self.orders)
        shape = (*map(len, self.axes), sides, sides * count, self.elements)
        if self.values.shape != shape or self.values.dtype != np.float32:
            raise DiffractionError(
                f"listed efficiencies are {self.values.dtype} of shape {self.values.shape}, "
                f"expected float32 of shape {shape}"
            )
        if any(len(axis) == 0 or (np.diff(axis) <= 0).any() for axis in self.axes):
            raise DiffractionError("wavelengths, theta and phi of a list must ascend")
        if not np.array_equal(self.orders, orders_between(self.orders[0], self.orders[-1])):
            raise DiffractionError("a list must have all orders between its first and its last")
        _check_elements(self.values, "listed light")


def orders_between(first: Sequence[int], last: Sequence[int]) -> NDArray[np.int64]:
    """Return all orders (m, 2) between two pairs (m_x, m_y), m_x innermost."""
    m_y, m_x = np.mgrid[first[1] : last[1] + 1, first[0] : last[0] + 1]
    return np.column_stack([m_x.ravel(), m_y.ravel()]).astype(np.int64)


@dataclass(frozen=True, eq=False, repr=False)
class OrderTable:
    """Efficiencies of the orders of a grating over directions and wavelengths.

    x is the direction in which the profile repeats, y the direction of its grooves; a crossed
    grating repeats along both. Order (m_x, m_y) of light whose mirror direction has the tangential
    part (x, y) leaves at x + m_x λ/(n d_x), y + m_y λ/(n d_y).

    Raises a DiffractionError if sizes do not fit, or numbers are not efficiencies: negative, not
    finite, or of a sum over orders above 1.001.

    Attributes
    ----------
    periods : d_x and d_y, µm; d_y is infinite for grooves.
    wavelengths : shortest and longest, in vacuum, nm. Light beyond them by less than `MARGIN`
        has the nearest efficiencies: longer light at the same s and K, shorter light in the
        same direction. Other light has none.
    response : efficiencies or Mueller matrices, of all light (`CellResponse`) or of a
        list (`ListedResponse`). Matrices are about the axes of `polarised`.
    superstrate : index of the clear medium above the profile. Above 1 it is a flat layer, too
        thick to interfere, as the polycarbonate of a CD.
    header : facts for people and programs, JSON: `solver`, `solver_version`, `settings`,
        `material`, `profile`; `error_mean` and `error_worst`, the measured error of interpolation
        as a share of the incident light.
    thin : whether the profile is the upper side of a thin sheet, whose lower side is flat. The
        table then has the light on both sides, at the ports of `cells`.
    block : index of a clear block, of which the profile is the upper face, or None. The table then
        has the light on both sides, at the nodes and ports of `blocks`.
    """

    periods: tuple[float, float]
    wavelengths: tuple[float, float]
    response: CellResponse | ListedResponse
    superstrate: float = 1.0
    header: Mapping[str, Any] = field(default_factory=dict)
    thin: bool = False
    block: float | None = None

    plugin: ClassVar[str] = "diffraction_orders"  #: BSDF of the table

    # Set by the package, since look-ups and files build on this class
    efficiency: ClassVar[Callable[..., Array]]  #: of an order: `efficiency.efficiency`
    polarised_efficiency: ClassVar[Callable[..., Array]]  #: `efficiency.polarised_efficiency`
    groove_efficiency: ClassVar[Callable[..., Array]]  #: `efficiency.groove_efficiency`
    mueller: ClassVar[Callable[..., Array]]  #: matrices of an order: `efficiency.mueller`
    jones: ClassVar[Callable[..., Any]]  #: Jones matrices of an order: `efficiency.jones`
    load: ClassVar[Callable[..., OrderTable]]  #: from a file: `file.load_orders`
    save: ClassVar[Callable[..., None]]  #: to a file: `file.save_orders`

    def __post_init__(self) -> None:
        listed = isinstance(self.response, ListedResponse)
        check_outline(
            self.periods, self.wavelengths, self.superstrate, self.thin, self.block, listed=listed
        )
        if self.crossed and not listed:
            raise DiffractionError("a crossed grating has listed light, no cells of grooves")
        self.response.check(self)

    @classmethod
    def mirror(
        cls,
        period: float,
        reflectance: float = 1.0,
        wavelengths: tuple[float, float] = (380.0, 780.0),
        superstrate: float = 1.0,
    ) -> OrderTable:
        """Return the table of a flat surface of constant reflectance, with one node a band."""
        periods = (period, math.inf)
        check_outline(periods, wavelengths, superstrate)

        def values(count: int) -> NDArray[np.float32]:
            diagonal = reflectance * np.eye(count, dtype=np.float32)
            return np.stack([diagonal, 0.0 * diagonal], axis=-1)[None, None, None]

        bands = tuple(
            Band(k, values(k + 1), values(k) if k else None)
            for k in range(largest_band(wavelengths, superstrate * period) + 1)
        )
        return cls(periods, wavelengths, CellResponse(bands), superstrate, {"profile": "flat"})

    @property
    def period(self) -> float:
        """Period of grooves, or the longer one of a crossed grating, µm."""
        return max(self.periods) if self.crossed else self.periods[0]

    @property
    def crossed(self) -> bool:
        """Whether the grating repeats along y as well."""
        return math.isfinite(self.periods[1])

    @property
    def optical_period(self) -> float:
        """Period times the index of the medium of its channels, n d, µm: above, or of a block."""
        return (self.block or self.superstrate) * self.period

    @property
    def reach(self) -> tuple[float, float]:
        """Wavelengths between which light has efficiencies, nm; see `MARGIN`."""
        low, high = self.wavelengths
        return low * 2.0**-MARGIN, high * 2.0**MARGIN

    @property
    def layout(self) -> str:
        """Size of the grid, for people."""
        return self.response.layout

    @property
    def sides(self) -> int:
        """Number of sides with light: 2 of a thin sheet or a block, else 1."""
        return 2 if self.thin or self.block else 1

    @property
    def polarised(self) -> bool:
        """Whether the table has Mueller matrices."""
        return self.response.elements == MUELLER

    @property
    def bands(self) -> tuple[Band, ...]:
        """Bands of a table over cells.

        Raises a DiffractionError for listed light.
        """
        if isinstance(self.response, ListedResponse):
            raise DiffractionError("a table of listed light has no bands; see `rows.on_cells`")
        return self.response.bands

    @property
    def last_band(self) -> int:
        """Band of in-plane light of the shortest wavelength."""
        return largest_band(self.wavelengths, self.optical_period)

    @cached_property
    def reciprocity(self) -> float:
        """Largest unpolarised difference between efficiencies for forward and for reversed light.

        Share of the incident light: η_m(ωi) = η_m(−ωo) (reciprocity theorem; Petit 1980). Of tables
        over cells.
        """
        residuals = []
        for band in self.bands:
            for values in band.kinds:
                unpolarised = values[..., 0]
                # t becomes 1 − t, and channel j → q becomes last − q → last − j
                ports = cells.reversed_ports(values.shape[3], self.sides)
                reverse = np.flip(unpolarised[..., ports, :][..., ports], 0).swapaxes(3, 4)
                residuals.append(float(np.abs(unpolarised - reverse).max()))
        return max(residuals)

    @property
    def albedo(self) -> float:
        """Mean over nodes and ports of the sum over orders of all sides, unpolarised."""
        if isinstance(self.response, ListedResponse):
            return float(self.response.values[..., 0].sum(axis=-1).mean())
        return float(np.mean([kind[..., 0].sum(axis=-1).mean() for kind in self.response.arrays]))

    @property
    def nbytes(self) -> int:
        """Size of the numbers in memory."""
        return sum(part.nbytes for part in self.response.arrays)

    def digest(self) -> str:
        """SHA-256 of all that look-ups depend on; not of the header."""
        return self._digest

    @cached_property
    def _digest(self) -> str:
        outline = [self.periods, self.wavelengths, self.superstrate, self.thin, self.block]
        content = hashlib.sha256()
        if isinstance(self.response, ListedResponse):
            outline.append(self.response.in_plane)
            for axis in (*self.response.axes, self.response.orders):
                content.update(np.ascontiguousarray(axis, np.float64).data)
        else:
            outline.append(self.response.even)
        shapes = [part.shape for part in self.response.arrays]
        content.update(json.dumps([outline, shapes]).encode())
        for part in self.response.arrays:
            content.update(np.ascontiguousarray(part).data)
        return content.hexdigest()

    def summary(self) -> dict[str, Any]:
        """Plain numbers and strings for people and for JSON."""
        shown: dict[str, Any] = {
            "period_um": self.period,
            "wavelength_range_nm": list(self.wavelengths),
            "superstrate_index": self.superstrate,
            "thin_sheet": self.thin,
            "block_index": self.block,
            "polarised": self.polarised,
            "grid": self.layout,
            "mean_albedo": round(self.albedo, 4),
            "memory_mb": round(self.nbytes / 1e6, 2),
            **self.header,
        }
        if self.crossed:
            shown["periods_um"] = list(self.periods)
        if isinstance(self.response, CellResponse):
            shown["reciprocity_residual"] = self.reciprocity
        return shown

    def __repr__(self) -> str:
        low, high = self.wavelengths
        periods = f"{self.periods[0]:g} µm"
        if self.crossed:
            periods = f"{self.periods[0]:g} x {self.periods[1]:g} µm"
        medium = "" if self.superstrate == 1.0 else f" under index {self.superstrate:g}"
        medium = ", thin sheet" if self.thin else medium
        medium = f", block of index {self.block:g}" if self.block else medium
        medium += ", polarised" if self.polarised else ""
        return (
            f"OrderTable({periods}{medium}, {low:g}–{high:g} nm, {self.layout}, "
            f"{self.nbytes / 1e6:.1f} MB)"
        )


def check_wavelengths(wavelengths: Sequence[float]) -> tuple[float, float]:
    """Return the shortest and the longest wavelength, nm.

    Raises a DiffractionError with the allowed values.
    """
    low, high = map(float, wavelengths)
    if not WAVELENGTHS[0] <= low <= high <= WAVELENGTHS[1]:
        raise DiffractionError(
            f"wavelengths={low:g}, {high:g} nm must rise from {WAVELENGTHS[0]:g} to "
            f"{WAVELENGTHS[1]:g} nm"
        )
    return low, high


def check_outline(
    periods: tuple[float, float],
    wavelengths: Sequence[float],
    superstrate: float = 1.0,
    thin: bool = False,
    block: float | None = None,
    *,
    listed: bool = False,
) -> None:
    """Refuse a period, wavelengths or an index outside their ranges.

    listed : whether the table is of listed light, with as many orders as that has.

    Raises a DiffractionError with the allowed values.
    """
    for period in (periods[0], *([] if math.isinf(periods[1]) else [periods[1]])):
        if not PERIODS[0] <= period <= PERIODS[1]:  # also refuses NaN
            raise DiffractionError(
                f"period={period:g} µm must be {PERIODS[0]:g} to {PERIODS[1]:g} µm"
            )
    low, high = check_wavelengths(wavelengths)
    if not 1.0 <= superstrate <= 5.0:
        raise DiffractionError(f"superstrate={superstrate:g} must be an index of 1 to 5")
    if math.isfinite(periods[1]) and (superstrate != 1.0 or thin or block is not None):
        raise DiffractionError(
            f"superstrate={superstrate:g}: crossed gratings reflect light in air; leave out "
            "superstrate, thin and block, and give the angles in air"
        )
    if thin and superstrate != 1.0:
        raise DiffractionError(
            f"superstrate={superstrate:g}: a thin sheet has the same medium on both sides; leave "
            "the superstrate out, and give the sheet's index relative to that medium"
        )
    if block is not None and not (LEAST_BLOCK <= block <= 5.0 and superstrate == 1.0 and not thin):
        raise DiffractionError(
            f"block={block:g} must be an index of {LEAST_BLOCK:g} to 5, relative to the medium "
            "above, without a superstrate and not thin"
        )
    optical_period = (block or superstrate) * periods[0]
    if not listed and largest_band((low, high), optical_period) >= MOST_BANDS:
        raise DiffractionError(
            f"a period of {periods[0]:g} µm has over {MOST_BANDS} orders at {low:g} nm; solve "
            "some directions of light alone (theta), or use the BSDF 'diffraction'"
        )


def _check_band(band: Band, sides: int, elements: int) -> None:
    tau, rho, w = band.counts
    if not 1 <= min(tau, rho, w) <= max(tau, rho, w) <= MOST_NODES:
        raise DiffractionError(
            f"band {band.k} has {tau} x {rho} x {w} nodes; each count must be 1 to {MOST_NODES}"
        )
    if (band.b is None) != (band.k == 0):
        raise DiffractionError(f"band {band.k}: kind B must be there for all bands but band 0")
    for name, values, channels in zip("AB", band.kinds, (band.k + 1, band.k), strict=False):
        ports = sides * channels
        expected = (tau, rho, w, ports, ports, elements)
        if values.shape != expected or values.dtype != np.float32:
            raise DiffractionError(
                f"band {band.k}, kind {name}: {values.dtype} of shape {values.shape}, expected "
                f"float32 of shape {expected}"
            )
        _check_elements(values, f"band {band.k}, kind {name}")


def _check_elements(values: NDArray[np.float32], where: str) -> None:
    """Refuse elements (…, ports, n) that are no Mueller matrices of efficiencies."""
    efficiency = values[..., 0]
    if values.shape[-1] not in (UNPOLARISED, ALONG, LINEAR, MUELLER):
        raise DiffractionError(
            f"{where}: {values.shape[-1]} elements of Mueller matrices; expected 1, 2, 3 or 16"
        )
    if not np.isfinite(values).all() or efficiency.min() < 0.0:
        wrong = efficiency[~(efficiency >= 0.0) | ~np.isfinite(efficiency)]
        shown = wrong[0] if len(wrong) else values[~np.isfinite(values)][0]
        raise DiffractionError(
            f"{where}: an efficiency is {shown:g}; all must be finite and at least 0"
        )
    largest = float(efficiency.sum(axis=-1, dtype=np.float64).max())
    if largest > LARGEST_SUM:
        raise DiffractionError(
            f"{where}: efficiencies sum to {largest:.4g} over the orders; at most {LARGEST_SUM} is "
            "allowed: use more points or modes in the solver"
        )
    if (np.abs(values) > efficiency[..., None] + ROUNDING).any():
        raise DiffractionError(
            f"{where}: Mueller matrices are not those of the efficiencies; solve the table again"
        )
