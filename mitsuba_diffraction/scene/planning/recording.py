"""What a scene is loaded with beyond its own parameters: a plan to follow, or a record to keep.

A BSDF cannot be given more than its scene says. While a session is open, the plugin `diffraction`
makes BSDFs that get their tables from it, as the plan restricts them, and that it has recorded:
then as `RecordedDiffraction`, which writes down every look-up.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...plugin.directions import Pair
from ...plugin.properties import own_id
from ...plugin.sampling import share_sampler
from ...plugin.types import (
    BSDF,
    Colour,
    Context,
    Float,
    Interaction,
    Mask,
    Properties,
    Spectrum,
    Vector2f,
)
from ...settings import TableSettings
from ...tables.store import cached_table, table_key
from ...tables.table import DiffractionTable

_one_at_a_time = threading.Lock()


@dataclass(frozen=True)
class Recorded:
    """What one BSDF was asked in one call; lanes without light are left out."""

    bsdf: int  # index among the session's BSDFs
    lane: NDArray[np.int64]  # (n,) what the caller put into `si.time`
    # u, v: (n,) tangential part of ωi + ωo in the patch's frame
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    w: NDArray[np.float32]  # (n,) its normal part times height_scale
    value: NDArray[np.float32]  # (n, wavelengths) what diffraction alone returned, f·cosθo


@dataclass
class Session:
    """Open it (`with`) around the loading of a scene.

    limits : fields of `TableSettings` by the key of the table that they restrict.
    sample_like : tables by the key of another, which is to draw directions as they do: pictures of
        both then differ by what they look up, and by nothing else.
    timing : build tables that the cache may have, too, and note how long that takes.
    recording : whether BSDFs are to record what they are asked, between `start` and `records`.
    """

    limits: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    sample_like: Mapping[str, DiffractionTable] = field(default_factory=dict)
    recording: bool = False
    timing: bool = False
    # key of every table that was built from heights, in the order of loading
    tables: dict[str, DiffractionTable] = field(default_factory=dict)
    # that each took to build, with `timing`
    seconds: dict[str, float] = field(default_factory=dict)
    # every `diffraction` BSDF that was loaded, with its name for people
    bsdfs: list[tuple[str, Any]] = field(default_factory=list)
    _buffers: list[list[Any]] = field(default_factory=list)

    def __enter__(self) -> Self:
        if not _one_at_a_time.acquire(blocking=False):
            raise DiffractionError("a scene is being planned already; load one at a time")
        mi.register_bsdf("diffraction", self._make)
        return self

    def __exit__(self, *_: object) -> None:
        from ...plugin.bsdf import Diffraction

        mi.register_bsdf("diffraction", Diffraction)
        _one_at_a_time.release()

    def _make(self, props: Properties) -> BSDF:
        bsdf = _kind(self)(props, self.table)
        self.register(bsdf, props.id())
        return bsdf

    def key_of(self, table: DiffractionTable) -> str | None:
        """The key of a table, or None for one that came from a file."""
        return next((key for key, mine in self.tables.items() if mine is table), None)

    def register(self, bsdf: BSDF, given: str) -> None:
        """Note a BSDF that was loaded, by its id or else by its heights."""
        heights = bsdf.table.source.get("name") or "heights without a name"
        name = own_id(given) or f"a diffraction BSDF without id (of {heights})"
        self.bsdfs.append((name, bsdf))

    def table(
        self,
        digest: str,
        settings: TableSettings,
        build: Callable[[TableSettings], DiffractionTable],
    ) -> DiffractionTable:
        """The table of heights with this digest, as far as the plan needs it."""
        key = table_key(digest, settings)
        restricted = replace(settings, **self.limits.get(key, {}))
        made = []
        if self.timing:
            start = time.perf_counter()
            made.append(build(restricted))
            self.seconds[key] = time.perf_counter() - start
        table = cached_table(digest, restricted, lambda: made[0] if made else build(restricted))
        self.tables[key] = table
        if key in self.sample_like:
            like = self.sample_like[key]
            share_sampler(table, like)
            share_sampler(table.averaged, like.averaged)
        return table

    def start(self, lanes: int) -> None:
        """Record from now on what `lanes` lanes ask, each a BSDF once at most."""
        channels = len(dr.zeros(mi.UnpolarizedSpectrum))
        self._buffers = [
            [dr.opaque(mi.Float, 0.0, lanes) for _ in range(3 + channels)] for _ in self.bsdfs
        ]

    def record(
        self, bsdf: BSDF, si: Interaction, uv: Vector2f, scaled_w: Float, value: Colour
    ) -> None:
        """Keep what a BSDF was asked and what it answered; for the BSDF to call."""
        if not self._buffers:
            return
        number = next(n for n, (_, mine) in enumerate(self.bsdfs) if mine is bsdf)
        lane = mi.UInt32(si.time)
        columns = (uv.x, uv.y, scaled_w, *value)
        buffers = self._buffers[number]
        lit = dr.any(value > 0.0) & (lane < dr.width(buffers[0]))
        for buffer, column in zip(buffers, columns, strict=True):
            dr.scatter(buffer, mi.Float(column), lane, lit)

    def records(self) -> list[Recorded]:
        """What was recorded; nothing more is."""
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


def _kind(session: Session) -> type[BSDF]:
    """The plugin of the current variant; one that records, where the session does."""
    from ...plugin.bsdf import Diffraction

    if not session.recording:
        return Diffraction

    class RecordedDiffraction(Diffraction):
        """Writes down every look-up of `eval` and `eval_pdf`."""

        def diffracted(
            self, ctx: Context, si: Interaction, pair: Pair, power: Colour, active: Mask
        ) -> Spectrum:
            value = super().diffracted(ctx, si, pair, power, active)
            light = mi.unpolarized_spectrum(value)
            session.record(self, si, pair.uv, pair.w * self.scale_at(si, active), light)
            return value

    return RecordedDiffraction
