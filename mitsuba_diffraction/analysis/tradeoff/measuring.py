"""Error, colour difference, time and memory of table settings, measured in one run."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...heights import HeightField
from ...plugin.memory import upload
from ...progress import Progress, silent
from ...tables import DiffractionTable
from ...tables.colour.table import power_colour_difference
from ..timing import Queries, kernel_seconds, quiet_bsdf, ratio, rounds_of
from .accuracy import LitPairs, Sample, window_sums


@dataclass(frozen=True)
class TradeoffSetting:
    """Settings of a table besides the defaults, as options of the commands have them."""

    group: str  # name of the parameter that varies
    arguments: dict[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """The options to type, as `--basis svd --terms 8`."""
        return " ".join(f"--{n} {_text(v)}" for n, v in self.arguments.items()) or "the defaults"

    @property
    def coherence(self) -> str:
        """Coherence of the table."""
        return str(self.arguments.get("coherence", "ensemble"))


def _text(value: Any) -> str:
    return f"{value:.0e}" if isinstance(value, float) else str(value)


def settings(quick: bool) -> Iterator[TradeoffSetting]:
    """Yield the settings to measure, the defaults first."""
    yield TradeoffSetting("default")
    for tolerance in (1e-2, 1e-4) if quick else (1e-2, 1e-4, 1e-5, 1e-6):
        yield TradeoffSetting("tolerance", {"tolerance": tolerance})
    for basis in ("chebyshev", "taylor"):
        for tolerance in (1e-3,) if quick else (1e-2, 1e-3, 1e-4):
            yield TradeoffSetting("basis", {"basis": basis, "tolerance": tolerance})
    for basis in ("svd", "chebyshev"):
        for terms in (4, 8) if quick else (4, 6, 8, 12):
            yield TradeoffSetting(f"terms, {basis}", {"basis": basis, "terms": terms})
    for tolerance in (1e-3,) if quick else (1e-2, 1e-3):
        yield TradeoffSetting("coherence", {"coherence": "patch", "tolerance": tolerance})


#: Tolerance of the table with which colours are compared; its error is invisible.
FINEST = 1e-5


@dataclass(frozen=True)
class MeasuredSetting:
    """Results of one setting."""

    setting: TradeoffSetting
    refused: str = ""  # error of a table that cannot be built; all other results are then missing
    # Σ|table − exact| / Σ exact, the larger of near order 0 and elsewhere, double precision
    error: float = float("nan")
    error_single: float = float("nan")  # error of the plugin, in single precision
    # ΔE2000 of random directions in daylight from the finest table: mean, 99th percentile
    delta_e: float = float("nan")
    delta_e_99: float = float("nan")
    nanoseconds: float = float("nan")  # time of `eval` with four wavelengths
    relative: float = float("nan")  # time over that of `roughconductor` (Al), median of rounds
    taps: int = 0  # number of bins that a look-up reads
    terms: int = 0  # numbers per bin
    intervals: int = 0  # intervals of κ
    precision: str = ""
    megabytes: float = float("nan")  # size of the table
    seconds: float = float("nan")  # time to build the table


def measure(
    field: HeightField,
    chosen: Sequence[TradeoffSetting],
    *,
    coherence_width: float,
    pairs: int = 240,
    lanes: int = 1 << 19,
    rounds: int = 7,
    progress: Progress = silent,
) -> list[MeasuredSetting]:
    """Measure all settings for one patch, in the current (spectral) variant.

    Raises a DiffractionError if the patch is flat, or the first table cannot be built.

    Parameters
    ----------
    field : the patch.
    chosen : settings to measure, the default first.
    coherence_width : µm.
    pairs : number of pairs of directions and wavelengths for errors.
    lanes, rounds : queries per call, and number of timed calls.
    progress : called as progress(done, total, text).
    """
    samples, finest = {}, {}
    for mode in sorted({setting.coherence for setting in chosen}):
        samples[mode] = Sample.draw(field, coherence_width, mode, pairs, progress)
        finest[mode] = DiffractionTable.build(
            field, coherence_width=coherence_width, coherence=mode, tolerance=FINEST
        )
    results, calls = [], {}
    rough = mi.load_dict({"type": "roughconductor", "material": "Al"})
    queries = Queries.random(lanes)
    context = mi.BSDFContext()
    calls[""] = partial(rough.eval, context, queries.si, queries.wo)
    for n, setting in enumerate(chosen):
        progress(n, len(chosen), setting.name)
        start = time.perf_counter()
        try:
            table = DiffractionTable.build(
                field, coherence_width=coherence_width, **setting.arguments
            )
        except DiffractionError as error:
            if n == 0:
                raise
            results.append(MeasuredSetting(setting, refused=str(error)))
            continue
        seconds = time.perf_counter() - start
        bsdf = quiet_bsdf(table, energy_conserving=False)
        calls[setting.name] = partial(bsdf.eval, context, queries.si, queries.wo)
        sample = samples[setting.coherence]
        loss = power_colour_difference(finest[setting.coherence], table)
        _, _, _, _, terms = table.coefficients.shape
        results.append(
            MeasuredSetting(
                setting,
                error=max(sample.error(window_sums(table, *sample.pairs[:3]))),
                error_single=max(sample.error(_by_plugin(bsdf, sample.pairs))),
                delta_e=float(loss.mean()),
                delta_e_99=float(np.percentile(loss, 99.0)),
                taps=table.grid.taps_read,
                terms=terms,
                intervals=table.expansion.intervals,
                precision="half" if table.coefficients.dtype == np.float16 else "single",
                megabytes=table.nbytes / 1e6,
                seconds=seconds,
            )
        )
    timed = {name: partial(kernel_seconds, call) for name, call in calls.items()}
    times = rounds_of(timed, rounds, lambda done, total: progress(done, total, "timing"))
    return [
        result if result.refused else replace(
            result,
            nanoseconds=float(np.median(times[result.setting.name])) / lanes * 1e9,
            relative=ratio(times[result.setting.name], times[""]),
        )
        for result in results
    ]  # fmt: skip


def _by_plugin(bsdf: Any, pairs: LitPairs) -> NDArray[np.float64]:
    """Return the window sums (n,) by the plugin, in single precision."""
    k = 2e3 * np.pi / pairs.wavelength
    total = mi.Vector3f((pairs.wi + pairs.wo).T)
    device = bsdf.power.device
    wavenumber = upload(mi.Float, k)
    sums = device.window_sum(wavenumber * total.x, wavenumber * total.y, wavenumber * total.z)
    return np.array(sums, float)
