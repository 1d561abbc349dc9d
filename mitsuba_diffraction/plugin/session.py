"""What a scene is loaded with, beyond its own parameters: a plan to follow, or a record to keep.

A BSDF cannot be given more than its scene says. A session that is open while a scene loads is
asked by every `diffraction` plugin which part of its table the scene needs, and may have the
plugin record what it is asked. Scenes load in several threads, so it is one for the process.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Self

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from ..tables.table import DiffractionTable
from .names import own_id
from .sampling import share_sampler


@dataclass(frozen=True)
class Recorded:
    """What one BSDF was asked in one call; lanes without light are left out.

    Attributes
    ----------
    bsdf : index among the session's BSDFs.
    lane : (n,) what the caller put into `si.time`.
    u, v : (n,) tangential part of ωi + ωo in the patch's frame.
    w : (n,) its normal part times height_scale.
    value : (n, wavelengths) what diffraction alone returned, f·cosθo.
    """

    bsdf: int
    lane: NDArray[np.int64]
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    w: NDArray[np.float32]
    value: NDArray[np.float32]


@dataclass
class Session:
    """Open it (`with`) around the loading of a scene.

    Parameters
    ----------
    limits : arguments of `DiffractionTable.build` by the key of the table that they restrict.
    sample_like : tables by the key of another, which is to draw directions as they do: pictures of
        both then differ by what they look up, and by nothing else.
    timing : build tables that the cache may have, too, and note how long that takes.
    recording : whether BSDFs are to record what they are asked, between `listen` and `heard`.

    Attributes
    ----------
    tables : key of every table that was built from heights, in the order of loading.
    seconds : that each took to build, with `timing`.
    bsdfs : every `diffraction` BSDF that was loaded, with its name for people.
    listening : whether calls are recorded at the moment.
    """

    limits: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    sample_like: Mapping[str, DiffractionTable] = field(default_factory=dict)
    recording: bool = False
    timing: bool = False
    tables: dict[str, DiffractionTable] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    bsdfs: list[tuple[str, Any]] = field(default_factory=list)
    listening: bool = False
    _buffers: list[list[Any]] = field(default_factory=list)

    def __enter__(self) -> Self:
        global _open
        if _open is not None:
            raise DiffractionError("a scene is being planned already; load one at a time")
        _open = self
        return self

    def __exit__(self, *_: object) -> None:
        global _open
        _open = None

    def key_of(self, table: DiffractionTable) -> str | None:
        """The key of a table, or None for one that came from a file."""
        return next((key for key, mine in self.tables.items() if mine is table), None)

    def listen(self, lanes: int) -> None:
        """Record from now on what `lanes` lanes ask, each a BSDF once at most."""
        channels = len(dr.zeros(mi.UnpolarizedSpectrum))
        self._buffers = [
            [dr.opaque(mi.Float, 0.0, lanes) for _ in range(3 + channels)] for _ in self.bsdfs
        ]
        self.listening = True

    def hear(self, bsdf: int, si: Any, uv: Any, scaled_w: Any, value: Any) -> None:
        """Keep what a BSDF was asked and what it answered; for the BSDF to call."""
        lane = mi.UInt32(si.time)
        columns = (uv.x, uv.y, scaled_w, *value)
        buffers = self._buffers[bsdf]
        lit = dr.any(value > 0.0) & (lane < dr.width(buffers[0]))
        for buffer, column in zip(buffers, columns, strict=True):
            dr.scatter(buffer, mi.Float(column), lane, lit)

    def heard(self) -> list[Recorded]:
        """What was recorded; nothing more is."""
        self.listening = False
        found = []
        for number, buffers in enumerate(self._buffers):
            u, v, w, *value = (np.array(buffer) for buffer in buffers)
            values = np.stack(value, axis=1)
            lane = np.flatnonzero(values.max(axis=1) > 0.0)
            if len(lane):
                found.append(Recorded(number, lane, u[lane], v[lane], w[lane], values[lane]))
        self._buffers = []
        return found

    def close(self) -> None:
        """Let go of the scene: BSDFs know their session, which Python would not clear up."""
        self.bsdfs.clear()
        self.tables.clear()


_open: Session | None = None


def restricted_arguments(key: str, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """The arguments to build a table with, as the open session has them restricted."""
    if _open is None:
        return dict(arguments)
    return {**arguments, **_open.limits.get(key, {})}


def timed(key: str, build: Callable[[], DiffractionTable]) -> Callable[[], DiffractionTable]:
    """How to get a table that the cache has not; built at once where time is taken."""
    if _open is None or not _open.timing:
        return build
    start = time.perf_counter()
    table = build()
    _open.seconds[key] = time.perf_counter() - start
    return lambda: table


def note_table(key: str, table: DiffractionTable) -> None:
    """Tell the open session which table a key stands for."""
    if _open is not None:
        _open.tables[key] = table
        if key in _open.sample_like:
            share_sampler(table, _open.sample_like[key])


def enrol(bsdf: Any, given: str) -> tuple[Session, int] | None:
    """Tell the open session of a BSDF, by its id or else by its heights; what it records with."""
    if _open is None:
        return None
    heights = bsdf.table.source.get("name") or "heights without a name"
    name = own_id(given) or f"a diffraction BSDF without id (of {heights})"
    _open.bsdfs.append((name, bsdf))
    return (_open, len(_open.bsdfs) - 1) if _open.recording else None
