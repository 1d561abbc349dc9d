"""Loading a scene with other tables than it asks for, and with BSDFs that record their look-ups.

A BSDF cannot be given more than its scene says. While a session is open, the plugin `diffraction`
makes BSDFs that get their tables from it and, if it records, write down every look-up.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Self

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...plugin.description import Surface, describe
from ...plugin.directions import Pair, Site
from ...plugin.types import (
    BSDF,
    Colour,
    Context,
    Float,
    Interaction,
    Mask,
    Powers,
    Properties,
    Spectrum,
    Vector2f,
)
from ...settings import TableSettings
from ...tables.source import TableRequest, providing, table_key
from ...tables.table import DiffractionTable
from ..elements import own_id

_one_at_a_time = threading.Lock()


@dataclass(frozen=True)
class RecordedLookups:
    """Look-ups of one BSDF in one call; lanes without light are left out."""

    bsdf: int  # index among the session's BSDFs
    lane: NDArray[np.int64]  # (n,) value of `si.time` from the caller
    # u, v: (n,) tangential part of ωi + ωo in the patch's frame
    u: NDArray[np.float32]
    v: NDArray[np.float32]
    w: NDArray[np.float32]  # (n,) its normal part times height_scale
    value: NDArray[np.float32]  # (n, wavelengths) what diffraction alone returned, f·cosθo


@dataclass
class Session:
    """Open it (`with`) around the loading of a scene.

    settings_of : chooses the settings of each table that is asked for; None for the scene's own.
    recording : whether BSDFs record their look-ups, between `start` and `records`.
    """

    settings_of: Callable[[TableRequest], TableSettings] | None = None
    recording: bool = False
    # by the key of every table that was built from heights, in the order of loading
    requests: dict[str, TableRequest] = field(default_factory=dict)
    tables: dict[str, DiffractionTable] = field(default_factory=dict)
    # every `diffraction` BSDF that was loaded, with its name for people
    bsdfs: list[tuple[str, Any]] = field(default_factory=list)
    _buffers: list[list[Any]] = field(default_factory=list)

    def __enter__(self) -> Self:
        if not _one_at_a_time.acquire(blocking=False):
            raise DiffractionError("a scene is being planned already; load one at a time")
        mi.register_bsdf("diffraction", self._make)
        return self

    def __exit__(self, *_: object) -> None:
        from ...plugin.diffraction import Diffraction

        mi.register_bsdf("diffraction", Diffraction)
        _one_at_a_time.release()

    def load(self, load: Callable[[], Any]) -> Any:
        """Load a scene and release it."""
        try:
            with self:
                return load()
        finally:
            self.close()

    def _make(self, props: Properties) -> BSDF:
        with providing(self.table):
            bsdf = _kind(self)(props)
        heights = described_table(bsdf).source.get("name") or "heights without a name"
        name = own_id(props.id()) or f"a diffraction BSDF without id (of {heights})"
        self.bsdfs.append((name, bsdf))
        return bsdf

    def table(self, request: TableRequest) -> DiffractionTable:
        """The table that a BSDF asks for, with the settings that the session chooses."""
        key = table_key(request.digest, request.settings)
        settings = self.settings_of(request) if self.settings_of else request.settings
        self.requests[key], self.tables[key] = request, request.cached(settings)
        return self.tables[key]

    def start(self, lanes: int) -> None:
        """Record from now on what `lanes` lanes ask, each a BSDF once at most."""
        channels = len(dr.zeros(mi.UnpolarizedSpectrum))
        self._buffers = [
            [dr.opaque(mi.Float, 0.0, lanes) for _ in range(3 + channels)] for _ in self.bsdfs
        ]

    def record(
        self, bsdf: BSDF, si: Interaction, uv: Vector2f, scaled_w: Float, value: Colour
    ) -> None:
        """Record a look-up of a BSDF and its result; the BSDF calls it."""
        if not self._buffers:
            return
        number = next(n for n, (_, known) in enumerate(self.bsdfs) if known is bsdf)
        lane = mi.UInt32(si.time)
        columns = (uv.x, uv.y, scaled_w, *value)
        buffers = self._buffers[number]
        lit = dr.any(value > 0.0) & (lane < dr.width(buffers[0]))
        for buffer, column in zip(buffers, columns, strict=True):
            dr.scatter(buffer, mi.Float(column), lane, lit)

    def records(self) -> list[RecordedLookups]:
        """Look-ups since `start`; recording has ended."""
        result = []
        for number, buffers in enumerate(self._buffers):
            u, v, w, *value = (np.array(buffer) for buffer in buffers)
            values = np.stack(value, axis=1)
            lane = np.flatnonzero(values.max(axis=1) > 0.0)
            if len(lane):
                result.append(
                    RecordedLookups(number, lane, u[lane], v[lane], w[lane], values[lane])
                )
        self._buffers = []
        return result

    def close(self) -> None:
        """Let go of the scene: BSDFs know their session, which Python would not clear up."""
        self.bsdfs.clear()
        self.tables.clear()
        self.requests.clear()


def described_table(bsdf: BSDF) -> DiffractionTable:
    """Return the table of heights of a BSDF that a session made."""
    described = describe(bsdf)
    assert isinstance(described, Surface)
    return described.patch


def _kind(session: Session) -> type[BSDF]:
    """The plugin of the current variant; a subclass that records, where the session does."""
    from ...plugin.diffraction import Diffraction

    if not session.recording:
        return Diffraction

    class RecordedDiffraction(Diffraction):
        """Writes down every look-up of `eval` and `eval_pdf`."""

        def light(
            self, ctx: Context, site: Site, pair: Pair, power: Powers, active: Mask
        ) -> Spectrum:
            value = super().light(ctx, site, pair, power, active)
            light = mi.unpolarized_spectrum(value)
            session.record(self, site.si, pair.uv, pair.w * site.scale, light)
            return value

    return RecordedDiffraction
