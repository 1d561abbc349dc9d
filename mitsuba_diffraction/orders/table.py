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

from ..arrays import Real
from ..errors import DiffractionError
from . import cells
from .cells import largest_band
from .response import MUELLER, Band, CellResponse, ListedResponse

#: Wavelengths in vacuum, nm, and periods, µm, that a table may have.
WAVELENGTHS, PERIODS = (100.0, 20_000.0), (0.01, 1000.0)
#: Least index of a block: orders of light that goes through depend on n − 1.
LEAST_BLOCK = 1.01
#: Octaves beyond its wavelengths within which a table has its nearest efficiencies, and then none.
MARGIN = 0.1
#: Bands of a table at most: beyond, no renderer would want it.
MOST_BANDS = 256


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
    efficiency: ClassVar[Callable[..., Real]]  #: of an order: `efficiency.efficiency`
    polarised_efficiency: ClassVar[Callable[..., Real]]  #: `efficiency.polarised_efficiency`
    groove_efficiency: ClassVar[Callable[..., Real]]  #: `efficiency.groove_efficiency`
    mueller: ClassVar[Callable[..., Real]]  #: matrices of an order: `efficiency.mueller`
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
        self.response.check(self.sides, self.last_band)

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
        """Mean of the sum over orders of all sides, unpolarised.

        Over nodes and ports; of listed light over the listed directions.
        """
        if isinstance(self.response, ListedResponse):
            return self._listed_albedo(self.response)
        return float(np.mean([kind[..., 0].sum(axis=-1).mean() for kind in self.response.arrays]))

    @property
    def directions(self) -> list[list[float]]:
        """θ and φ of listed light, degrees: solved directions, or all of the grid."""
        assert isinstance(self.response, ListedResponse)
        _, polar, azimuths = self.response.axes
        grid = [[float(t), float(p)] for t in polar for p in azimuths if 0.0 <= p < 360.0]
        return list(self.header.get("directions", grid))

    def passage(self, came: int, left: int) -> dict[str, bool]:
        """Return the arguments of `efficiency` for light from one side to one side, 0 or 1."""
        return {"from_below": (came == 1) != bool(self.block), "transmitted": came != left}

    def _listed_albedo(self, response: ListedResponse) -> float:
        """Return the mean over the listed lights of the sum over orders that propagate."""
        theta, phi = np.radians(self.directions).T[:, :, None, None]
        lam, sums = response.axes[0][:, None], []
        for came in range(self.sides):
            index = self.block if self.block and came == 0 else 1.0  # the first side lies within
            mirror = (-index * np.sin(theta) * part(phi) for part in (np.cos, np.sin))
            light = *mirror, lam, *response.orders.T
            sums += [self.efficiency(*light, **self.passage(came, left)).sum(axis=-1)
                     for left in range(self.sides)]  # fmt: skip
        return float(np.mean(sums)) * self.sides

    @property
    def nbytes(self) -> int:
        """Size of the numbers in memory."""
        return sum(part.nbytes for part in self.response.arrays)

    def digest(self) -> str:
        """SHA-256 of all that look-ups depend on; not of the header."""
        return self._digest

    @cached_property
    def _digest(self) -> str:
        media = self.superstrate, self.thin, self.block or 0.0
        outline: list[Any] = [float(x) for x in (*self.periods, *self.wavelengths, *media)]
        content = hashlib.sha256()
        if isinstance(self.response, ListedResponse):
            index = self.response.index
            outline += [self.response.in_plane, *([] if index is None else [index])]
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
            "grid": self.response.layout,
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
            f"OrderTable({periods}{medium}, {low:g}–{high:g} nm, {self.response.layout}, "
            f"{self.nbytes / 1e6:.1f} MB)"
        )


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
    low, high = map(float, wavelengths)
    if not WAVELENGTHS[0] <= low <= high <= WAVELENGTHS[1]:
        raise DiffractionError(
            f"wavelengths={low:g}, {high:g} nm must rise from {WAVELENGTHS[0]:g} to "
            f"{WAVELENGTHS[1]:g} nm"
        )
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
