"""Albedo bounds kept by the content of their table: a few seconds' work, a few kilobytes' file."""

from __future__ import annotations

import hashlib
import json
import math
import threading
import weakref
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ...atomic import atomic_path
from ...errors import DiffractionError
from ..energy.albedo import LEAST_SPIKE, RINGS, SMOOTHING, STEPS
from ..energy.bound import AZIMUTHAL, LAST_ANGLE, MARGIN, POLAR, AlbedoBound, albedo_bound
from ..sampling.order_mixture import MOST_STRONG, STRONG
from ..table import DiffractionTable
from .cache import cache_folder

#: Raised whenever the computation of a bound changes.
VERSION = 2
#: The oldest files go beyond this number.
MOST_FILES = 512

#: Bounds are computed for height scales n/steps: this phase (rad) changes at most in between. The
#: power of an order bends by a fiftieth then, and by less at grazing angles, where there is most
#: to bound.
_PHASE = 0.8
_FEWEST_STEPS = 4
#: As good as no heights at all.
_FLAT = 1e-3

_SETTINGS = (
    VERSION, POLAR, AZIMUTHAL, LAST_ANGLE, MARGIN, LEAST_SPIKE, RINGS, STEPS, SMOOTHING, STRONG,
    MOST_STRONG,
)  # fmt: skip

_known: weakref.WeakKeyDictionary[DiffractionTable, dict[float, AlbedoBound]] = (
    weakref.WeakKeyDictionary()
)
_lock = threading.Lock()


@dataclass(frozen=True)
class BoundsAround:
    """Bounds at two height scales; in between, their linear interpolation is the bound.

    Attributes
    ----------
    scales : (lower, upper) height scale; equal where one is enough.
    bounds : of each.
    """

    scales: tuple[float, float]
    bounds: tuple[AlbedoBound, AlbedoBound]

    def share(self, height_scale: float) -> float:
        """Weight of the upper bound, 0 … 1."""
        low, high = self.scales
        return min(max((height_scale - low) / (high - low), 0.0), 1.0) if high > low else 0.0


def bounds_around(
    table: DiffractionTable, height_scale: float, *, interval: bool = False
) -> BoundsAround:
    """The bounds of a table's albedo at the two nodes around a height scale.

    The nodes lie evenly, 1 among them, so close that an order's power bends little in between. An
    optimisation of the heights thus sees a continuous bound with derivatives, and waits for a new
    one only where it enters an interval that nobody has been in before.

    interval : two nodes even if the scale is at one, for derivatives.
    """
    phase = 2.0 * table.reach * table.expansion.half_range
    steps = max(_FEWEST_STEPS, math.ceil(phase / _PHASE))
    # Beyond the table's own limit nothing can be looked up, so the last interval is shorter
    most = max(table.height_scale_max, _FLAT)

    def node(n: int) -> float:
        return min(max(n / steps, _FLAT), most)

    position = height_scale * steps  # of a scale in single precision
    lower = min(math.floor(position + 1e-4), math.ceil(most * steps - 1e-4) - 1)
    at_node = abs(position - lower) < 1e-4
    low = node(lower)
    if at_node and not interval:
        bound = _at(table, low)
        return BoundsAround((low, low), (bound, bound))
    high = node(lower + 1)
    return BoundsAround((low, high), (_at(table, low), _at(table, high)))


def cached_bound(table: DiffractionTable, height_scale: float) -> AlbedoBound:
    """The bound of a table's albedo at a height scale, from memory, from disk, or computed."""
    around = bounds_around(table, height_scale)
    low, high = (bound.values for bound in around.bounds)
    share = np.float32(around.share(height_scale))
    return AlbedoBound(low * (1 - share) + high * share)


def _at(table: DiffractionTable, height_scale: float) -> AlbedoBound:
    with _lock:
        bounds = _known.setdefault(table, {})
        if height_scale not in bounds:
            path = cache_folder() / f"albedo-{_key(table, height_scale)}.npy"
            values = _read(path)
            if values is None:
                bound = albedo_bound(table, height_scale)
                _write(path, bound.values)
            else:
                bound = AlbedoBound(values)
            bounds[height_scale] = bound
        return bounds[height_scale]


def _key(table: DiffractionTable, height_scale: float) -> str:
    """Name of the bound: the table's content, the scale and how it is computed."""
    described = json.dumps(
        [
            _SETTINGS, repr(height_scale), table.scale, repr(table.expansion), repr(table.grid),
            list(table.spacing), table.coherence_width, list(table.wavelength_range),
        ]
    )  # fmt: skip
    content = hashlib.sha256(described.encode())
    content.update(np.ascontiguousarray(table.order_0).tobytes())
    content.update(np.ascontiguousarray(table.coefficients).data)
    if table.coarse is not None:
        content.update(repr((table.radii, table.coarse.expansion, table.coarse.grid)).encode())
        content.update(np.ascontiguousarray(table.coarse.coefficients).data)
    return content.hexdigest()[:32]


def _read(path: Path) -> NDArray[np.float32] | None:
    """The values, or None if the file is missing or damaged: then they are computed anew."""
    try:
        values = np.load(path, allow_pickle=False)
    except (OSError, ValueError, EOFError):
        return None
    fits = values.shape == (POLAR + 1, AZIMUTHAL + 1) and values.dtype == np.float32
    return values if fits and bool(np.all(np.isfinite(values))) else None


def _write(path: Path, values: NDArray[np.float32]) -> None:
    """A cache that cannot be written is no reason to fail."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_path(path) as temporary:
            np.save(temporary, values)
        files = sorted(path.parent.glob("albedo-*.npy"), key=lambda p: p.stat().st_mtime)
        for old in files[:-MOST_FILES]:
            old.unlink(missing_ok=True)
    except (DiffractionError, OSError):
        return
