"""A table: everything needed to evaluate one patch's diffraction without a Fourier transform."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import DiffractionError
from ..heights.coherence import REPEATS
from ..optics.blend import RoughnessTable
from ..optics.geometry import sigma_of, wavenumber
from ..settings import TableSettings
from .expansion import Expansion
from .layout import Grid

#: Raised whenever the meaning of the coefficients changes; tables of another version are refused.
FORMAT_VERSION = 6


@dataclass(frozen=True, eq=False, repr=False)
class DiffractionTable:
    """Series coefficients of one patch's (or several patches') diffraction orders.

    Make one with `build` or `load`. All lengths in µm, wavelengths in nm.

    Attributes
    ----------
    coefficients : (intervals, ny, nx, components, terms) float32 or float16; one component for a
        power, two (real, imaginary) for an amplitude; divided by `scale` before use. Bin (0, 0)
        is in the middle of (ny, nx), and zero.
    order_0 : (intervals, components, expansion.series_terms) float64, the series of that bin; not
        scaled.
    scale : factor on the coefficients that suits half floats.
    expansion : which series in κ.
    grid : bins, window and taps.
    spacing : (dqx, dqy), rad/µm between bins.
    settings : requested settings.
    error : the measured error (see `build.error`): near order 0, far from it, and at which κ.
    roughness : height variance by spatial frequency, up to `q_limit`; the mean of several patches'.
    source : the heights: name, digest, size, statistics, history.
    """

    coefficients: NDArray[np.floating]
    order_0: NDArray[np.float64]
    scale: float
    expansion: Expansion
    grid: Grid
    spacing: tuple[float, float]
    settings: TableSettings
    error: Mapping[str, float]
    roughness: RoughnessTable
    source: Mapping[str, Any] = field(default_factory=dict)

    # Assigned in the package `tables`, to avoid a circular import
    build: ClassVar[Callable[..., DiffractionTable]]  #: from heights: `build.build.build_table`
    load: ClassVar[Callable[..., DiffractionTable]]  #: from a file: `exr.load_table`
    save: ClassVar[Callable[..., None]]  #: to a file: `exr.save_table`
    window_sum: ClassVar[Callable[..., NDArray[np.float64]]]  #: ⟨|P|²⟩: `lookup.window_sum`
    brdf: ClassVar[Callable[..., NDArray[np.float64]]]  #: the model for R = 1: `lookup.brdf`

    @property
    def coherence_width(self) -> float:
        """Width over which the light is coherent, µm: 4σ₀ of order 0's amplitude window."""
        return self.settings.light_width

    @property
    def window_width(self) -> float:
        """4σ of the amplitude window of all orders but 0, µm, at most `coherence_width`."""
        return self.settings.width

    @property
    def order_0_ratio(self) -> float:
        """(σ₀/σ)²: order 0's lobe is so many times as high and as small as other orders' lobes."""
        return (self.sigma_0 / self.sigma) ** 2

    @property
    def width_text(self) -> str:
        """Coherence width in words, with a mark where the patch's repetition shows as a grating."""
        mark = f" ({REPEATS})" if self.source.get("repeats") else ""
        limited = self.settings.window_width is not None
        scan = f", of orders {self.window_width:.4g} µm" if limited else ""
        return f"{self.coherence_width:.4g} µm{scan}{mark}"

    @property
    def coherence(self) -> str:
        """ "ensemble" or "patch"."""
        return self.settings.coherence

    @property
    def tolerance(self) -> float:
        """The relative error that was asked for."""
        return self.settings.tolerance

    @property
    def wavelength_range(self) -> tuple[float, float]:
        """Shortest and longest wavelength, nm."""
        return self.settings.wavelength_range

    @property
    def height_scale_max(self) -> float:
        """Largest factor on the heights that the table serves."""
        return self.settings.height_scale_max

    @property
    def largest_error(self) -> float:
        """The larger measured error: near order 0 or elsewhere, each at its worst κ."""
        return float(max(self.error["near"], self.error["far"]))

    @property
    def sigma(self) -> float:
        """σ of the window by which all orders but 0 are looked up, µm."""
        return sigma_of(self.settings.lookup_width)

    @property
    def inverse_taper(self) -> float:
        """1/σ_t² of the taper of a scan's windows, 1/µm²; 0 of a patch that tiles the plane."""
        taper = self.settings.taper_width
        return 0.0 if taper is None else sigma_of(taper) ** -2

    @property
    def sigma_0(self) -> float:
        """σ₀ of order 0's amplitude window, µm: the light's."""
        return sigma_of(self.coherence_width)

    @property
    def q_limit(self) -> float:
        """Largest spatial frequency k·|(u, v)| that light can probe, rad/µm."""
        return q_limit_of(self.wavelength_range)

    @property
    def frequency_limit(self) -> tuple[float, float]:
        """Half axes (x, y) of the ellipse in which the table has the orders, rad/µm."""
        return self.settings.frequency_limit or (self.q_limit, self.q_limit)

    @property
    def limited(self) -> bool:
        """Whether the table lacks orders that light can probe."""
        return self.settings.frequency_limit is not None

    @cached_property
    def averaged(self) -> DiffractionTable:
        """The mean over all windows on the patch: of `patch` the same amplitudes, whose powers are
        added; of `ensemble` itself.
        """
        if not self.grid.coherent:
            return self
        settings = replace(self.settings, coherence="ensemble")
        return replace(self, grid=replace(self.grid, coherent=False), settings=settings)

    def digest(self) -> str:
        """SHA-256 of all that look-ups depend on; not of names, statistics and measured errors."""
        return self._digest

    @cached_property
    def _digest(self) -> str:
        content = hashlib.sha256()
        expansion = {**asdict(self.expansion), "functions": None}
        plain = [asdict(self.settings), expansion, asdict(self.grid), self.spacing, self.scale]
        plain.append(self.roughness.first)
        arrays = (self.coefficients, self.order_0, self.roughness.nodes)
        for numbers in (*arrays, self.expansion.functions):
            if numbers is not None:
                plain.append([numbers.dtype.str, numbers.shape])
                content.update(np.ascontiguousarray(numbers).data)
        content.update(json.dumps(plain, sort_keys=True).encode())
        return content.hexdigest()

    @property
    def nbytes(self) -> int:
        """Size of the coefficients in memory."""
        return self.coefficients.nbytes

    def require_whole(self, what: str) -> None:
        """Refuse a limited table where all orders are needed.

        what : names what needs them, with its verb.

        Raises a DiffractionError if the table has a `frequency_limit`.
        """
        if self.limited:
            x, y = self.frequency_limit
            raise DiffractionError(
                f"{what} all orders, but the table ends at the frequencies {x:.4g} along x and "
                f"{y:.4g} rad/µm along y; give a table without frequency_limit, or the height field"
            )

    def covers(self, qx: ArrayLike, qy: ArrayLike, kappa: ArrayLike) -> NDArray[np.bool_]:
        """Whether the table has the orders there (to rounding in single precision)."""
        return self._within(self.frequency_limit, qx, qy, kappa)

    def reachable(self, qx: ArrayLike, qy: ArrayLike, kappa: ArrayLike) -> NDArray[np.bool_]:
        """Whether light of the table's wavelengths and heights can probe it."""
        return self._within((self.q_limit, self.q_limit), qx, qy, kappa)

    def _within(
        self, radii: tuple[float, float], qx: ArrayLike, qy: ArrayLike, kappa: ArrayLike
    ) -> NDArray[np.bool_]:
        slack = 1.0 + 1e-6
        inside = np.hypot(np.asarray(qx) / radii[0], np.asarray(qy) / radii[1]) <= slack
        return inside & (np.asarray(kappa) <= self.expansion.kappa_max * slack)

    def order_0_at(self, kappa: ArrayLike) -> NDArray[np.float64]:
        """Order 0 at κ (rad/µm): κ.shape + (components,), its power or the parts of a_0."""
        interval = self.expansion.interval(kappa)
        parts: NDArray[np.float64] = np.einsum(
            "...pt,...t->...p",
            self.order_0[interval],
            self.expansion.series_weights(kappa),
        )
        parts[..., 0] += self.expansion.order_0_offset(interval)
        return parts

    def summary(self) -> dict[str, Any]:
        """Plain numbers and strings for people and for JSON."""
        intervals, ny, nx, components, terms = self.coefficients.shape
        return {
            "basis": self.expansion.basis,
            "stores": self.expansion.kind,
            "coherence": self.coherence,
            "coherence_width_um": self.coherence_width,
            **({"window_width_um": self.window_width} if self.settings.window_width else {}),
            "wavelength_range_nm": list(self.wavelength_range),
            "height_scale_max": self.height_scale_max,
            "tolerance": self.tolerance,
            "measured_error": {
                "glossy (within 3/σ of order 0)": self.error["near"],
                "colours (all other orders)": self.error["far"],
            },
            "terms": terms,
            "intervals_of_kappa": intervals,
            "taps": list(self.grid.taps),
            "orders": [nx, ny],
            **({"frequency_limit": list(self.frequency_limit)} if self.limited else {}),
            "components": components,
            "precision": str(self.coefficients.dtype),
            "memory_mb": round(self.nbytes / 1e6, 2),
            "source": dict(self.source),
        }

    def __repr__(self) -> str:
        intervals, ny, nx, _, terms = self.coefficients.shape
        return (
            f"DiffractionTable({self.expansion.basis} {self.expansion.kind}, {self.coherence}, "
            f"{nx}×{ny} orders, {intervals}×{terms} terms, {self.coefficients.dtype}, "
            f"{self.nbytes / 1e6:.1f} MB)"
        )


def q_limit_of(wavelength_range: tuple[float, float]) -> float:
    """2k at the shortest wavelength, rad/µm: |(u, v)| is at most 2."""
    return float(2.0 * wavenumber(wavelength_range[0]))


def build_error(text: str) -> DiffractionError:
    """An error about a table that cannot be built."""
    return DiffractionError(f"cannot build the table: {text}")
