"""Albedo bounds kept by the content of their table: a few seconds' work, a few kilobytes' file."""

from __future__ import annotations

import hashlib
import json
import math
import threading
import weakref
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from ..tables.albedo import LEAST_SPIKE, RINGS, SMOOTHING, STEPS
from ..tables.atoms import MOST_STRONG, STRONG
from ..tables.bound import AZIMUTHAL, LAST_ANGLE, MARGIN, POLAR, AlbedoBound, albedo_bound
from ..tables.table import DiffractionTable
from .atomic import atomic_path
from .cache import cache_folder

#: Raised whenever the computation of a bound changes.
VERSION = 1
#: The oldest files go beyond this number.
MOST_FILES = 512

#: Bounds are computed for height scales 2^(n/steps): this phase (rad) changes between neighbours.
_PHASE = 0.3

_SETTINGS = (
    VERSION, POLAR, AZIMUTHAL, LAST_ANGLE, MARGIN, LEAST_SPIKE, RINGS, STEPS, SMOOTHING, STRONG,
    MOST_STRONG,
)  # fmt: skip

_known: weakref.WeakKeyDictionary[DiffractionTable, dict[float, AlbedoBound]] = (
    weakref.WeakKeyDictionary()
)
_lock = threading.Lock()


def cached_bound(table: DiffractionTable, height_scale: float) -> AlbedoBound:
    """The bound of a table's albedo at a height scale.

    Scales lie between those of a fine geometric grid, which holds 1; a bound is interpolated
    between its two neighbours there, so that an optimisation of the heights stays continuous and
    needs few of them.
    """
    phase = 2.0 * table.reach * table.expansion.half_range
    steps = max(8, math.ceil(math.log(2.0) * phase / _PHASE))
    position = steps * math.log2(height_scale)
    lower = math.floor(position + 1e-6)
    share = position - lower
    low = _at(table, 2.0 ** (lower / steps))
    if share < 1e-5:
        return low
    # Beyond the table's own limit nothing can be looked up, so the last interval is shorter
    upper = min(2.0 ** ((lower + 1) / steps), table.height_scale_max)
    span = steps * math.log2(upper) - lower
    high = _at(table, upper)
    share = min(share / span, 1.0) if span > 0.0 else 0.0
    values = low.values * np.float32(1.0 - share) + high.values * np.float32(share)
    return AlbedoBound(values)


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
