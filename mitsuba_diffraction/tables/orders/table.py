"""Table of the orders of a periodic profile, solved rather than modelled."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from . import cells
from .cells import Array, B, largest_band, nodes

#: Sum over all orders that a table may have: 1, but for a solver's error.
LARGEST_SUM = 1.001
#: Largest difference between M₀₀ ± M₀₁ and efficiencies: packing in 16 bits, and sums above 1.
ROUNDING = 2e-3
#: Wavelengths in vacuum, nm, and periods, µm, that a table may have.
WAVELENGTHS, PERIODS = (100.0, 20_000.0), (0.01, 1000.0)
#: Least index of a block: orders of light that goes through depend on n − 1.
LEAST_BLOCK = 1.01
#: Components of a table's light: E, or B, along the grooves; or s and p, of imported efficiencies.
GROOVES, S_AND_P = "grooves", "s and p"
#: Octaves beyond its wavelengths within which a table has its nearest efficiencies, and then none.
MARGIN = 0.1
#: Bands, and nodes along an axis, at most: beyond, no renderer would want it.
MOST_BANDS, MOST_NODES = 256, 64


class Counts(NamedTuple):
    """Numbers of nodes along τ, ρ and w."""

    tau: int
    rho: int
    w: int


@dataclass(frozen=True, eq=False, repr=False)
class Band:
    """Efficiencies of the directions whose K has the same whole part k (`cells`).

    Attributes
    ----------
    k : the band.
    a : (τ, ρ, w, k + 1, k + 1, 2) float32, kind A: share of the light incident through channel j
        (fourth axis) that leaves through channel q (fifth), for incident light whose E, or B, lies
        along the grooves (last; s, or p, in light across them), summed over the polarisations of
        the leaving light. Nodes are `cells.nodes`. A sheet has ports instead of channels, twice as
        many.
    b : (τ, ρ, w, k, k, 2) of kind B, with the same nodes; None for k = 0.
    mueller : of a polarised table, the Mueller matrices (τ, ρ, w, j, q, 4, 4) of each kind, about
        the axes of `polarised`, where M₀₀ ± M₀₁ are the efficiencies; else None.
    """

    k: int
    a: NDArray[np.float32]
    b: NDArray[np.float32] | None = None
    mueller: tuple[NDArray[np.float32], ...] | None = field(default=None, kw_only=True)

    @property
    def counts(self) -> Counts:
        """Numbers of nodes."""
        return Counts(*self.a.shape[:3])

    def kind(self, kind: int) -> NDArray[np.float32]:
        """Return the efficiencies of a kind, `cells.A` or `cells.B`.

        Raises a DiffractionError for kind B of band 0, which has no directions.
        """
        if kind == B and self.b is None:
            raise DiffractionError("kind B of band 0 has no propagating order; ask for kind A")
        return self.kinds[kind]

    @property
    def kinds(self) -> tuple[NDArray[np.float32], ...]:
        """Efficiencies of kind A and, but for band 0, of kind B."""
        return (self.a,) if self.b is None else (self.a, self.b)

    @property
    def arrays(self) -> tuple[NDArray[np.float32], ...]:
        """Efficiencies, then Mueller matrices, of all kinds."""
        return self.kinds + (self.mueller or ())


@dataclass(frozen=True, eq=False, repr=False)
class OrderTable:
    """Efficiencies of the orders of a periodic profile, at nodes of smooth coordinates.

    x is the direction in which the profile repeats, y the direction of its grooves. Coordinates
    are defined in `cells`.

    Raises a DiffractionError if sizes do not fit, or numbers are not efficiencies: negative, not
    finite, or of a sum over orders above 1.001.

    Attributes
    ----------
    period : µm.
    wavelengths : shortest and longest, in vacuum, nm. Light beyond them by less than `MARGIN`
        has the nearest efficiencies: longer light at the same s and K, shorter light in the
        same direction. Other light has none.
    bands : of k = 0, 1, …, `cells.largest_band`.
    superstrate : index of the clear medium above the profile. Above 1 it is a flat layer, too
        thick to interfere, as the polycarbonate of a CD.
    header : facts for people and programs, JSON: `solver`, `solver_version`, `settings`,
        `material`, `profile`; `error_mean` and `error_worst`, the measured error of interpolation
        as a share of the incident light.
    thin : whether the profile is the upper side of a thin sheet, whose lower side is flat. The
        table then has the light on both sides, at the ports of `cells`.
    components : of the incident light that efficiencies belong to: `GROOVES`, or `S_AND_P`.
    block : index of a clear block, of which the profile is the upper face, or None. The table then
        has the light on both sides, at the nodes and ports of `blocks`.
    """

    period: float
    wavelengths: tuple[float, float]
    bands: tuple[Band, ...]
    superstrate: float = 1.0
    header: Mapping[str, Any] = field(default_factory=dict)
    thin: bool = False
    components: str = GROOVES
    block: float | None = None

    # Set by the package, since look-ups and files build on this class
    efficiency: ClassVar[Callable[..., Array]]  #: of an order: `lookup.efficiency`
    polarised_efficiency: ClassVar[Callable[..., Array]]  #: `lookup.polarised_efficiency`
    groove_efficiency: ClassVar[Callable[..., Array]]  #: `lookup.groove_efficiency`
    mueller: ClassVar[Callable[..., Array]]  #: matrices of an order: `lookup.mueller`
    load: ClassVar[Callable[..., OrderTable]]  #: from a file: `file.load_orders`
    save: ClassVar[Callable[..., None]]  #: to a file: `file.save_orders`

    def __post_init__(self) -> None:
        check_outline(self.period, self.wavelengths, self.superstrate, self.thin, self.block)
        expected = self.last_band + 1
        if [band.k for band in self.bands] != list(range(expected)):
            raise DiffractionError(
                f"{len(self.bands)} bands of orders, expected {expected}, k = 0 to {expected - 1}: "
                f"period {self.period:g} µm at {self.wavelengths[0]:g} nm and index "
                f"{self.block or self.superstrate:g}"
            )
        for band in self.bands:
            _check_band(band, self.sides)

        if self.components not in (GROOVES, S_AND_P) or (
            self.components == S_AND_P and self.polarised
        ):
            raise DiffractionError(
                f"components={self.components!r}: must be {GROOVES!r}, or {S_AND_P!r} without "
                "Mueller matrices"
            )

    @classmethod
    def mirror(
        cls,
        period: float,
        reflectance: float = 1.0,
        wavelengths: tuple[float, float] = (380.0, 780.0),
        superstrate: float = 1.0,
    ) -> OrderTable:
        """Return the table of a flat surface of constant reflectance, with one node a band."""
        check_outline(period, wavelengths, superstrate)

        def values(count: int) -> NDArray[np.float32]:
            diagonal = reflectance * np.eye(count, dtype=np.float32)
            return np.repeat(diagonal[None, None, None, ..., None], 2, axis=-1)

        bands = tuple(
            Band(k, values(k + 1), values(k) if k else None)
            for k in range(largest_band(wavelengths, superstrate * period) + 1)
        )
        return cls(period, wavelengths, bands, superstrate, {"profile": "flat"})

    @property
    def optical_period(self) -> float:
        """Period times the index of the medium of its channels, n d, µm: above, or of a block."""
        return (self.block or self.superstrate) * self.period

    @property
    def reach(self) -> tuple[float, float]:
        """Wavelengths between which light has efficiencies, nm; see `MARGIN`."""
        return reach_of(self.wavelengths)

    @property
    def layout(self) -> str:
        """Size of the grid, for people."""
        return f"{len(self.bands)} bands"

    @property
    def sides(self) -> int:
        """Number of sides with light: 2 of a thin sheet or a block, else 1."""
        return 2 if self.thin or self.block else 1

    @property
    def polarised(self) -> bool:
        """Whether the table has Mueller matrices."""
        return all(band.mueller is not None for band in self.bands)

    @property
    def last_band(self) -> int:
        """Band of in-plane light of the shortest wavelength."""
        return largest_band(self.wavelengths, self.optical_period)

    def band_nodes(self, k: int) -> tuple[Array, Array, Array]:
        """Return the nodes τ, ρ and w of a band."""
        tau, rho, w = (nodes(count) for count in self.bands[k].counts)
        return tau, rho, w

    @cached_property
    def reciprocity(self) -> float:
        """Largest unpolarised difference between efficiencies for forward and for reversed light.

        Share of the incident light: η_m(ωi) = η_m(−ωo) (reciprocity theorem; Petit 1980).
        """
        residuals = []
        for band in self.bands:
            for values in band.kinds:
                unpolarised = values.mean(axis=-1)
                # t becomes 1 − t, and channel j → q becomes last − q → last − j
                ports = cells.reversed_ports(values.shape[3], self.sides)
                reverse = np.flip(unpolarised[..., ports, :][..., ports], 0).swapaxes(3, 4)
                residuals.append(float(np.abs(unpolarised - reverse).max()))
        return max(residuals)

    @property
    def albedo(self) -> float:
        """Mean over nodes and channels of the sum over orders of all sides, unpolarised."""
        sums = [kind.sum(axis=-2).mean() for band in self.bands for kind in band.kinds]
        return float(np.mean(sums))

    @property
    def nbytes(self) -> int:
        """Size of the numbers in memory."""
        return sum(part.nbytes for band in self.bands for part in band.arrays)

    def digest(self) -> str:
        """SHA-256 of all that look-ups depend on; not of the header."""
        return self._digest

    @cached_property
    def _digest(self) -> str:
        outline = [self.period, self.wavelengths, self.superstrate, self.thin]
        outline += [self.block] if self.block else []
        shapes = [kind.shape for band in self.bands for kind in band.kinds]
        content = hashlib.sha256(json.dumps([outline, shapes]).encode())
        for band in self.bands:
            for part in band.arrays:
                content.update(np.ascontiguousarray(part).data)
        return content.hexdigest()

    def summary(self) -> dict[str, Any]:
        """Plain numbers and strings for people and for JSON."""
        return {
            "period_um": self.period,
            "wavelength_range_nm": list(self.wavelengths),
            "superstrate_index": self.superstrate,
            "thin_sheet": self.thin,
            "block_index": self.block,
            "polarised": self.polarised,
            "components": self.components,
            "bands": len(self.bands),
            "nodes": sorted({" x ".join(map(str, band.counts)) for band in self.bands}),
            "mean_albedo": round(self.albedo, 4),
            "reciprocity_residual": self.reciprocity,
            "memory_mb": round(self.nbytes / 1e6, 2),
            **self.header,
        }

    def __repr__(self) -> str:
        low, high = self.wavelengths
        medium = "" if self.superstrate == 1.0 else f" under index {self.superstrate:g}"
        medium = ", thin sheet" if self.thin else medium
        medium = f", block of index {self.block:g}" if self.block else medium
        medium += ", polarised" if self.polarised else ""
        return (
            f"OrderTable({self.period:g} µm{medium}, {low:g}–{high:g} nm, {len(self.bands)} bands, "
            f"{self.nbytes / 1e6:.1f} MB)"
        )


def reach_of(wavelengths: tuple[float, float]) -> tuple[float, float]:
    """Return the wavelengths between which light of a table has efficiencies; see `MARGIN`."""
    low, high = wavelengths
    return low * 2.0**-MARGIN, high * 2.0**MARGIN


def check_wavelengths(wavelengths: Sequence[float]) -> tuple[float, float]:
    """Return the shortest and the longest wavelength, nm.

    Raises a DiffractionError with the allowed values.
    """
    low, high = wavelengths
    if not WAVELENGTHS[0] <= low <= high <= WAVELENGTHS[1]:
        raise DiffractionError(
            f"wavelengths={low:g}, {high:g} nm must rise from {WAVELENGTHS[0]:g} to "
            f"{WAVELENGTHS[1]:g} nm"
        )
    return low, high


def check_outline(
    period: float,
    wavelengths: Sequence[float],
    superstrate: float,
    thin: bool = False,
    block: float | None = None,
) -> None:
    """Refuse a period, wavelengths or an index outside their ranges.

    Raises a DiffractionError with the allowed values.
    """
    if not PERIODS[0] <= period <= PERIODS[1]:  # also refuses NaN
        raise DiffractionError(f"period={period:g} µm must be {PERIODS[0]:g} to {PERIODS[1]:g} µm")
    low, high = check_wavelengths(wavelengths)
    if not 1.0 <= superstrate <= 5.0:
        raise DiffractionError(f"superstrate={superstrate:g} must be an index of 1 to 5")
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
    if largest_band((low, high), (block or superstrate) * period) >= MOST_BANDS:
        raise DiffractionError(
            f"a period of {period:g} µm has over {MOST_BANDS} orders at {low:g} nm; solve orders "
            "of shorter periods, and use the BSDF 'diffraction' for this one"
        )


def _check_band(band: Band, sides: int) -> None:
    tau, rho, w = band.counts
    if not 1 <= min(tau, rho, w) <= max(tau, rho, w) <= MOST_NODES:
        raise DiffractionError(
            f"band {band.k} has {tau} x {rho} x {w} nodes; each count must be 1 to {MOST_NODES}"
        )
    if (band.b is None) != (band.k == 0):
        raise DiffractionError(f"band {band.k}: kind B must be there for all bands but band 0")
    if band.mueller is not None:
        _check_mueller(band)
    for name, values, channels in zip("AB", band.kinds, (band.k + 1, band.k), strict=False):
        ports = sides * channels
        expected = (tau, rho, w, ports, ports, 2)
        if values.shape != expected or values.dtype != np.float32:
            raise DiffractionError(
                f"band {band.k}, kind {name}: {values.dtype} of shape {values.shape}, expected "
                f"float32 of shape {expected}"
            )
        if not np.isfinite(values).all() or values.min() < 0.0:
            wrong = values[~(values >= 0.0) | ~np.isfinite(values)][0]
            raise DiffractionError(
                f"band {band.k}, kind {name}: an efficiency is {wrong:g}; all must be finite and "
                "at least 0"
            )
        largest = float(values.sum(axis=-2, dtype=np.float64).max())
        if largest > LARGEST_SUM:
            raise DiffractionError(
                f"band {band.k}, kind {name}: efficiencies sum to {largest:.4g} over the orders; "
                f"at most {LARGEST_SUM} is allowed: use more points or modes in the solver"
            )


def _check_mueller(band: Band) -> None:
    assert band.mueller is not None
    fits = [m.shape for m in band.mueller] == [(*v.shape[:-1], 4, 4) for v in band.kinds]
    for values, matrices in zip(band.kinds, band.mueller if fits else (), strict=False):
        sums = matrices[..., 0, :1] + matrices[..., 0, 1:2] * [1.0, -1.0]
        # also refuses NaN
        fits &= bool(np.all(np.abs(matrices) <= matrices[..., :1, :1] + ROUNDING))
        fits &= bool(np.all(np.abs(sums - values) <= ROUNDING))
    if not fits:
        raise DiffractionError(
            f"band {band.k}: Mueller matrices are not those of its efficiencies; solve the table "
            "again"
        )
