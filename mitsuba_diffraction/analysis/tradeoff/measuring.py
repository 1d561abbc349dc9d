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
from ...heights.field import HeightField
from ...plugin.memory import upload
from ...progress import Progress, silent
from ...tables.build.coefficients import half_scale
from ...tables.colour.table import power_colour_difference
from ...tables.table import DiffractionTable, q_limit_of
from ..timing import Queries, kernel_seconds, quiet_bsdf, ratio, rounds_of
from .accuracy import Sample


@dataclass(frozen=True)
class TradeoffSetting:
    """Table of the trade-off: its label, build arguments, and conversions afterwards."""

    group: str  # name of the parameter that varies
    name: str  # label of this value
    # arguments of `DiffractionTable.build`, besides the patch and the coherence width
    arguments: dict[str, Any] = field(default_factory=dict)
    # precision to which the coefficients are converted: "half" or "single"; None: as built
    stored: str | None = None
    # largest spatial frequency as a share of those that light reaches, or None for all
    crop: float | None = None

    @property
    def coherence(self) -> str:
        """Coherence of the table."""
        return str(self.arguments.get("coherence", "ensemble"))

    @property
    def usable(self) -> bool:
        """Whether users can build this table: no conversion, and a proper tolerance."""
        return self.stored is None and self.arguments.get("tolerance", 1e-3) < _ANY


#: Tolerance that every table meets, so that the other parameters alone determine the error.
_ANY = 0.999


def settings(quick: bool) -> Iterator[TradeoffSetting]:
    """Yield the settings to measure, the defaults first."""
    yield TradeoffSetting("default", "the defaults")
    for tolerance in (1e-2, 1e-4) if quick else (1e-2, 1e-4, 1e-5, 1e-6):
        yield TradeoffSetting("tolerance", f"tolerance {tolerance:.0e}", {"tolerance": tolerance})
    for basis in ("chebyshev", "taylor"):
        for tolerance in (1e-3,) if quick else (1e-2, 1e-3, 1e-4):
            arguments = {"basis": basis, "tolerance": tolerance}
            yield TradeoffSetting("basis", f"{basis}, {tolerance:.0e}", arguments)
    for basis in ("svd", "chebyshev"):
        for terms in (4, 8) if quick else (4, 6, 8, 12):
            arguments = {"basis": basis, "terms": terms}
            yield TradeoffSetting(f"terms, {basis}", f"{terms} terms, {basis}", arguments)
    for taps in (2, 3, 4) if quick else (2, 3, 4, 5):
        arguments = {"terms": 12, "taps": taps, "tolerance": _ANY}
        yield TradeoffSetting("taps", f"{taps} × {taps} taps", arguments)
    for stored in ("half", "single"):
        yield TradeoffSetting(
            "precision", f"tolerance 1e-4 in {stored}", {"tolerance": 1e-4}, stored
        )
    for crop in (0.5,) if quick else (0.75, 0.5, 0.35):
        yield TradeoffSetting("crop", f"up to {crop:g} of all frequencies", crop=crop)
    for tolerance in (1e-3,) if quick else (1e-2, 1e-3):
        arguments = {"coherence": "patch", "tolerance": tolerance}
        yield TradeoffSetting("coherence", f"patch, {tolerance:.0e}", arguments)


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
            table = _table(field, setting, coherence_width)
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
                error=max(sample.error(sample.window_sums(table))),
                error_single=max(sample.error(_by_plugin(bsdf, sample))),
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
    return [_with_times(result, times, lanes) for result in results]


def _table(
    field: HeightField, setting: TradeoffSetting, coherence_width: float
) -> DiffractionTable:
    """Build the table of a setting, and convert its precision if the setting has one."""
    arguments: dict[str, Any] = dict(setting.arguments)
    if setting.crop is not None:
        arguments["frequency_limit"] = setting.crop * q_limit_of((360.0, 830.0))
    table = DiffractionTable.build(field, coherence_width=coherence_width, **arguments)
    if setting.stored is None:
        return table
    kind: Any = np.float16 if setting.stored == "half" else np.float32
    scale = half_scale(float(np.abs(table.coefficients).max()))
    coefficients = (table.coefficients.astype(np.float32) * np.float32(scale)).astype(kind)
    return replace(table, coefficients=coefficients, scale=table.scale * scale)


def _by_plugin(bsdf: Any, sample: Sample) -> NDArray[np.float64]:
    """Return the window sums (n,) by the plugin, in single precision."""
    k = 2e3 * np.pi / sample.wavelength
    total = mi.Vector3f((sample.wi + sample.wo).T)
    device = bsdf.power.device
    wavenumber = upload(mi.Float, k)
    sums = device.window_sum(wavenumber * total.x, wavenumber * total.y, wavenumber * total.z)
    return np.array(sums, float)


def _with_times(
    result: MeasuredSetting, times: dict[str, list[float]], lanes: int
) -> MeasuredSetting:
    """Add the times of `eval` to a result, unless its table was refused."""
    if result.refused:
        return result
    seconds = times[result.setting.name]
    return replace(
        result,
        nanoseconds=float(np.median(seconds)) / lanes * 1e9,
        relative=ratio(seconds, times[""]),
    )


def rows(results: Sequence[MeasuredSetting]) -> Iterator[dict[str, Any]]:
    """Yield one flat record of plain data for each setting."""
    for result in results:
        setting = result.setting
        names = {"group": setting.group, "setting": setting.name}
        arguments = {"arguments": setting.arguments, "usable": setting.usable}
        measured = {name: value for name, value in vars(result).items() if name != "setting"}
        yield names | arguments | measured
