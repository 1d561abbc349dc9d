"""Responses of gratings: elements of Mueller matrices of all light, over cells, or of a list."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Real
from ..errors import DiffractionError, counted
from . import cells
from .cells import Counts

#: Sum over all orders that a table may have: 1, but for a solver's error.
LARGEST_SUM = 1.001
#: Largest excess of an element of a Mueller matrix over its efficiency: single precision, and
#: sums above 1 that were scaled.
ROUNDING = 2e-3
#: Nodes along an axis at most: beyond, no renderer would want them.
MOST_NODES = 64
#: Largest θ up to which, and widest gap between azimuths of a crossed grating from which on,
#: degrees, a list lacks directions.
STEEPEST, WIDEST_GAP = 75.0, 90.0
#: Decimals of degrees that tell directions apart.
DIGITS = 9
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

    @property
    def kinds(self) -> tuple[NDArray[np.float32], ...]:
        """Responses of `cells.A` and, but for band 0, of `cells.B`."""
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

    def nodes(self, k: int) -> tuple[Real, Real, Real]:
        """Return the nodes τ, ρ and w of a band."""
        along = cells.even_nodes if self.even else cells.nodes
        tau, rho, w = map(along, self.bands[k].counts)
        return tau, rho, w

    @property
    def layout(self) -> str:
        """Size, for people."""
        sizes = sorted({" x ".join(map(str, band.counts)) for band in self.bands})
        return f"{counted(len(self.bands), 'band')} of {', '.join(sizes)} nodes"

    def check(self, sides: int, last_band: int) -> None:
        """Raise a DiffractionError if sizes do not fit a table, or numbers are no efficiencies.

        sides, last_band : of the table; see `OrderTable`.
        """
        expected = last_band + 1
        if [band.k for band in self.bands] != list(range(expected)):
            raise DiffractionError(
                f"{counted(len(self.bands), 'band')}, expected {expected}, k = 0 to "
                f"{expected - 1}, by the table's period, shortest wavelength and index"
            )
        for band in self.bands:
            _check_band(band, sides, self.elements)


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
    index : of a clear material below a crossed grating, or None. With it, ratios of elements to
        `optics.orders.order_factor` are interpolated, of incident light about s.
    phases : (λ, θ, φ, sides, ports) float32, of polarised light: of the largest entry of each Jones
        matrix about the axes of `polarised`, the first of equal ones, at the origin of the profile;
        NaN where the light was not solved, or the order does not propagate. None: not known.
    """

    axes: tuple[Real, Real, Real]
    orders: NDArray[np.int64]
    values: NDArray[np.float32]
    index: float | None = None
    phases: NDArray[np.float32] | None = None

    @property
    def elements(self) -> int:
        """Number n of elements."""
        return int(self.values.shape[-1])

    @property
    def arrays(self) -> list[NDArray[np.float32]]:
        """All numbers."""
        return [self.values] if self.phases is None else [self.values, self.phases]

    @property
    def in_plane(self) -> bool:
        """Whether all light lies in the plane across the grooves.

        Other light then has the efficiencies of the light of the same K and s (`cells`), as with
        perfect conductors.
        """
        return bool(np.isin(self.axes[2], (0.0, 180.0)).all())  # φ of crossed ones passes the ends

    @property
    def layout(self) -> str:
        """Size, for people."""
        waves, theta, phi = map(len, self.axes)
        return (
            f"{counted(waves, 'wavelength')} x {theta} theta x {phi} phi, "
            f"{counted(len(self.orders), 'order')}"
        )

    def lacks_directions(self, crossed: bool) -> bool:
        """Whether some light is far from all listed directions, of which there are several."""
        _, theta, phi = self.axes
        bearings = len(phi) - 2 if crossed else len(phi)
        if len(theta) * bearings == 1:
            return False
        wide = np.diff(phi).max() > WIDEST_GAP if crossed else not {0.0, 180.0} <= set(phi)
        return bool(theta[-1] < STEEPEST or wide)

    def check(self, sides: int, last_band: int) -> None:
        """Raise a DiffractionError if sizes do not fit a table, or numbers are no efficiencies.

        sides, last_band : of the table; see `OrderTable`.
        """
        count = len(self.orders)
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
        if self.phases is not None and (
            self.elements != MUELLER or self.phases.shape != self.values.shape[:-1]
        ):
            raise DiffractionError(
                f"phases have the shape {self.phases.shape}, expected {self.values.shape[:-1]} of "
                "polarised light"
            )


def orders_between(first: Sequence[int], last: Sequence[int]) -> NDArray[np.int64]:
    """Return all orders (m, 2) between two pairs (m_x, m_y), m_x innermost."""
    m_y, m_x = np.mgrid[first[1] : last[1] + 1, first[0] : last[0] + 1]
    return np.column_stack([m_x.ravel(), m_y.ravel()]).astype(np.int64)


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


def canonical(theta: ArrayLike, phi: ArrayLike, crossed: bool) -> tuple[Real, Real]:
    """Return θ (b,) from 0 and φ (c,), (b, c) each: φ to 180° on grooves, below 360° on crossed."""
    theta, azimuth = np.meshgrid(theta, phi, indexing="ij")
    turned = (azimuth + np.where(theta < 0.0, 180.0, 0.0)) % 360.0
    phi = np.asarray(np.round(turned, DIGITS) % 360.0, np.float64)
    if not crossed:  # mirror images are alike
        phi = np.asarray(np.round(np.minimum(phi, 360.0 - phi), DIGITS), np.float64)
    return np.asarray(np.round(np.abs(theta), DIGITS), np.float64), phi
