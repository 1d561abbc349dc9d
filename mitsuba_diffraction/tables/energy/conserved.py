"""Materials whose energy is conserved: a reflector, or a dielectric that lets light through."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...optics import boundary, fresnel, through
from ...optics.coat import cosine_within
from ...optics.fresnel import Filmed
from ...optics.paths import ABOVE, Path, Returned, Side
from ...optics.stack import Stacked

#: n + ik of the material at wavelengths (n,), nm, or that under a film; None for R = 1.
Index = Callable[[Real], "NDArray[np.complex128] | Filmed | Stacked | None"]
#: Cosine of 89°: a critical angle closer to the horizon does not matter.
_LAST_COSINE = 0.0175
#: Wavelengths at which a material is told from another.
PROBES = 24


@dataclass(frozen=True)
class Reflector:
    """Material that light meets from above and that is asked for reflected light alone.

    Attributes
    ----------
    model : one of `optics.boundary.MODELS`.
    index : of the material relative to the medium at the structure.
    coat : index of a coat relative to the medium above; 1 without a coat.
    """

    model: str
    index: Index
    coat: float = 1.0

    @property
    def densest(self) -> float:
        """Largest index of the media that light travels in, relative to the medium above."""
        return self.coat

    def paths(self, wavelengths: Real, least: float) -> list[list[Path]]:
        """Return the one path of light at each wavelength (nm); `least` does not matter to it."""
        index = self.index(wavelengths)
        indices = [None] * len(wavelengths) if index is None else index
        side = Side(1.0, self.coat)
        return [[Path(indices[n], self.model, side, side)] for n in range(len(wavelengths))]

    def key(self, wavelength_range: tuple[float, float]) -> list[object]:
        """Return the material's part of the cache key over a range of wavelengths (nm)."""
        index = rounded(self.index(np.geomspace(*wavelength_range, PROBES)))
        return [self.model, index, self.coat]

    def total(self, index: Any) -> bool:
        """Whether light from above is totally reflected from some angle on.

        index : of the material at wavelengths (n,), as `index` returns it.
        """
        if index is None:
            return False
        within = cosine_within(np.array(_LAST_COSINE), np.array(self.coat))
        return bool(fresnel.reflectance(within, index[:, None]).max() > 1.0 - 1e-9)

    def phase(self, wavelength_range: tuple[float, float]) -> float:
        """Phase (rad) by which a film's fringe advances over a range of wavelengths (nm)."""
        film = self.index(np.array(wavelength_range[:1]))
        share = 1.0 - wavelength_range[0] / wavelength_range[1]
        return film.phase * share if isinstance(film, Filmed | Stacked) else 0.0


@dataclass(frozen=True)
class Transmitter:
    """Dielectric that light meets from both sides and that lets light through.

    Attributes
    ----------
    index : relative to the medium above.
    model : one of `optics.through.MODELS`.
    thin : whether below is beyond the flat side of a sheet.
    """

    index: float
    model: str
    thin: bool

    @property
    def densest(self) -> float:
        """Largest index of the media that light travels in, relative to the medium above."""
        return self.index

    def paths(self, wavelengths: Real, least: float) -> list[list[Path]]:
        """Return the paths of light at each wavelength; least : w of light let through."""
        n, model = self.index, boundary.checked_model(self.model, through.MODELS)
        below = Side(1.0 if self.thin else n, n, below=True)
        paths = [
            Path(n, model, ABOVE, ABOVE),
            Path(n, model, ABOVE, below, least),
            Path(n, model, below, ABOVE, least),
            Path(1.0 / n, model, below, below),
        ]
        if self.thin:
            paths.insert(0, Returned(None, model, sheet=n))
        return [paths] * len(wavelengths)

    def phase(self, wavelength_range: tuple[float, float]) -> float:
        """Return 0: no film is on the interface."""
        return 0.0

    def key(self, wavelength_range: tuple[float, float]) -> list[object]:
        """Return what tells this dielectric from another material."""
        return [self.index, self.model, self.thin]


def rounded(index: NDArray[np.complex128] | Filmed | Stacked | None) -> list[str] | None:
    """Round indices to five digits: single precision's noise makes no other material."""
    if index is None:
        return None
    parts: Sequence[Any] = index.parts if isinstance(index, Filmed) else [index]
    if isinstance(index, Stacked):
        parts = [index.table + 0j]
    return [f"{n.real:.5g} {n.imag:.5g}" for part in parts for n in np.ravel(part)]
