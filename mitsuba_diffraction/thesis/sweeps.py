"""The thesis' sweeps: one parameter of a BRDF map after the other, compared and timed.

Maps for every value, how long each took, how far each is from the reference; and the default
look-up against `flss`, both compiled: the same map, timed side by side (Dr.Jit).
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..analysis.maps.result import BrdfMap, Light
from ..errors import DiffractionError
from ..heights.field import HeightField
from ..optics.colour import delta_e
from ..progress import Progress
from ..tables.table import DiffractionTable
from .methods import NAMES, FullSpectrum, Gain, Method, make, make_all
from .methods.make import method_map

_MOST_VALUES = 24
# Pixels of the reference this much darker than the brightest away from the mirror are unlit.
_LIT = 1e-4

#: Each is timed so often, in turns; the first of them only warms up.
_ROUNDS = 3
# What Mitsuba's spectral variants span, nm.
_RANGE = (360.0, 830.0)


@dataclass(frozen=True)
class _Kind:
    """A sweep's parameter."""

    unit: str  # printed after values
    values: tuple[Any, ...]  # by default
    reference: Any  # the value that others are compared with; `None`: the maps differ by intent


SWEEPS: dict[str, _Kind] = {
    "wavelength-step": _Kind(" nm", (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0), "smallest"),
    "coherence-width": _Kind(" µm", (30.0, 45.0, 65.0, 100.0), "largest"),
    "terms": _Kind(" terms", (2, 4, 6, 8, 10, 12, 15, 18), "largest"),
    "light-angle": _Kind("°", (0.0, 15.0, 30.0, 45.0, 60.0, 75.0), None),
    "method": _Kind("", NAMES, "flss"),
}


@dataclass(frozen=True, eq=False)
class Step:
    """One value."""

    value: Any  # of the parameter
    label: str  # with its unit
    map: BrdfMap  # the colours
    seconds: float  # that the map took, without tables
    # mean, high: ΔE2000 from the reference (`colour.delta_e`) over the pixels that it lights, mean
    # and 95th percentile; NaN where there is no reference
    mean: float
    high: float
    # the same mean when both have their own exposure: difference of colour, not of light
    own_mean: float
    # ΣZ/ΣX over that of the reference, away from the mirror's lobe; above 1 is bluer
    blueness: float


@dataclass(frozen=True, eq=False)
class Sweep:
    """All steps of a sweep, and the label of the one that the others are compared with."""

    kind: str
    steps: tuple[Step, ...]
    reference: str | None


def sweep(
    kind: str,
    heights: HeightField,
    light: Light,
    *,
    values: Sequence[Any] | None = None,
    method: str = "flss",
    resolution: int = 128,
    samples: int = 1,
    gain: Gain | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Sweep:
    """A map for every value of a parameter.

    Parameters
    ----------
    kind : one of `SWEEPS`.
    heights : the patch.
    light : direction to the light; a sweep over its angle keeps the azimuth.
    values : of the parameter; by default the sweep's own.
    method : what evaluates; not for a sweep over methods. `terms` needs one with a Taylor series.
    resolution, samples, gain : see `maps.method_map`.
    progress : called as progress(done, total, text).
    settings : of `methods.make_all`; a sweep over methods has coherence="patch" by default.

    Raises
    ------
    DiffractionError
        If a name or value does not fit.
    """
    if kind not in SWEEPS:
        raise DiffractionError(f"sweep '{kind}' is unknown; choose one of {', '.join(SWEEPS)}")
    chosen = tuple(SWEEPS[kind].values if values is None else values)
    if not 1 <= len(chosen) <= _MOST_VALUES:
        raise DiffractionError(f"{len(chosen)} values are to be swept; give 1 to {_MOST_VALUES}")
    if gain is not None and ("rainbow" in chosen or method == "rainbow"):
        raise DiffractionError("method 'rainbow' has no relative reflectance; leave it out")
    made = _made(kind, chosen, heights, light, method, progress, settings)
    common: dict[str, Any] = {
        "resolution": resolution, "samples": samples, "gain": gain, "progress": progress,
    }  # fmt: skip
    done = [
        (value, *timed_map(one, where, step=step, **common))
        for value, (one, where, step) in zip(chosen, made, strict=True)
    ]
    return _all_compared(kind, chosen, done)


def timed_map(method: Method, light: Light, **arguments: Any) -> tuple[BrdfMap, float]:
    """A map (arguments as in `maps.method_map`) and the seconds that it took."""
    start = time.perf_counter()
    found = method_map(method, light, **arguments)
    return found, time.perf_counter() - start


def _made(
    kind: str, values: Sequence[Any], heights: HeightField, light: Light, method: str,
    progress: Progress | None, settings: dict[str, Any],
) -> list[tuple[Method, Light, float]]:  # fmt: skip
    """For every value: method, light, and width of its wavelength step."""
    step = float(settings.get("step", 5.0))

    def one(**more: Any) -> Method:
        return make(method, heights, progress=progress, **(settings | more))

    if kind == "method":
        # one coherence for all: what differs then is the method
        alike = {"coherence": "patch"} | settings
        all_ = make_all(values, heights, progress=progress, **alike)
        return [(all_[name], light, step) for name in values]
    if kind == "light-angle":
        lights = [Light(float(value), light.phi) for value in values]
        fixed = one()
        return [(fixed, where, step) for where in lights]
    if kind == "wavelength-step":
        first = one(step=float(min(values)))
        # the table does not depend on the step
        if isinstance(first, FullSpectrum):
            table, span = first.table, first.wavelength_range
            return [(FullSpectrum(method, table, span, float(v)), light, float(v)) for v in values]
        return [(one(step=float(v)), light, float(v)) for v in values]
    if kind == "coherence-width":
        return [(one(coherence_width=float(v)), light, step) for v in values]
    if method != "flss":
        raise DiffractionError(
            f"a sweep over terms needs method 'flss', whose series is Taylor's; not '{method}'"
        )
    full = one()
    assert isinstance(full, FullSpectrum)
    return [
        (FullSpectrum("flss", truncated(full.table, v), full.wavelength_range, step), light, step)
        for v in values
    ]


def truncated(table: DiffractionTable, terms: int) -> DiffractionTable:
    """A Taylor table cut off after so many terms, or as it is if it has no more."""
    if terms != int(terms) or terms < 1:
        raise DiffractionError(f"terms={terms} must be a whole number, at least 1")
    count = min(int(terms), table.expansion.terms)
    return replace(
        table,
        coefficients=table.coefficients[..., :count],
        order_0=table.order_0[..., :count],
        expansion=replace(table.expansion, terms=count),
    )


def _all_compared(
    kind: str, values: Sequence[Any], done: Sequence[tuple[Any, BrdfMap, float]]
) -> Sweep:
    wanted = SWEEPS[kind].reference
    reference: int | None
    if wanted is None or (wanted == "flss" and "flss" not in values):
        reference = None
    elif wanted == "flss":
        reference = list(values).index("flss")
    else:
        reference = int(np.argmin(values) if wanted == "smallest" else np.argmax(values))
    base = None if reference is None else done[reference][1]
    steps = []
    for value, found, seconds in done:
        steps.append(compared(value, label_of(kind, value), base, found, seconds))
    label = None if reference is None else steps[reference].label
    return Sweep(kind, tuple(steps), label)


def compared(value: Any, label: str, base: BrdfMap | None, found: BrdfMap, seconds: float) -> Step:
    """A step, compared with the map `base` if there is one."""
    numbers = (np.nan,) * 4 if base is None else _distance(base, found)
    return Step(value, label, found, seconds, *numbers)


def label_of(kind: str, value: Any) -> str:
    """A value as it is printed."""
    return f"{value}" if kind == "method" else f"{value:g}{SWEEPS[kind].unit}"


def _distance(base: BrdfMap, other: BrdfMap) -> tuple[float, float, float, float]:
    """ΔE mean and 95th percentile, mean with own exposures, and blueness."""
    assert base.xyz is not None
    assert other.xyz is not None
    away = base.away_from_mirror()
    luminance = base.luminance.astype(np.float64)
    if not luminance.max() > 0.0:
        return (np.nan,) * 4
    # a grating is dark nearly everywhere, and no exposure would suit it: what it lights counts
    bright = np.percentile(luminance[away], 99.9)
    lit = luminance > _LIT * bright
    first, second = (m.linear[lit].astype(np.float64) for m in (base, other))
    apart = delta_e(first, second)
    levels = [np.percentile(m.luminance[lit], 95.0) for m in (base, other)]
    own = delta_e(first, second * (levels[0] / levels[1] if levels[1] > 0.0 else 1.0))
    shares = [m[away].sum(axis=0, dtype=np.float64) for m in (base.xyz, other.xyz)]
    blue = [share[2] / share[0] if share[0] > 0.0 else np.nan for share in shares]
    high = float(np.nanpercentile(apart, 95.0))
    return float(np.nanmean(apart)), high, float(np.nanmean(own)), float(blue[1] / blue[0])


@dataclass(frozen=True)
class Compiled:
    """Seconds of one map, the smallest of the rounds."""

    spectral: float  # the package's own look-up, at every wavelength
    colours: float  # as in RGB variants: one look-up in the table of the whole spectrum's colours
    flss: float  # the thesis' loop over wavelengths, terms and taps, an image a term

    @property
    def ratio(self) -> float:
        """How many times faster than `flss` the default is, wavelength by wavelength."""
        return self.flss / self.spectral

    @property
    def colour_ratio(self) -> float:
        """How many times faster than `flss` the default's colours are."""
        return self.flss / self.colours


def time_compiled(
    heights: HeightField,
    light: Light,
    *,
    resolution: int,
    samples: int,
    step: float = 5.0,
    coherence_width: float = 65.0,
    tolerance: float = 1e-3,
    progress: Progress | None = None,
) -> Compiled:
    """Evaluate one map of the whole spectrum in three ways; tables are not in the times.

    The variants llvm_ad_spectral and llvm_ad_rgb (or those for a GPU, if the one that is set is)
    are set in turn, the spectral one last.

    Raises
    ------
    DiffractionError
        If a parameter is out of range or a table cannot be built.
    """
    import mitsuba as mi

    from ..analysis.timing import quiet_bsdf
    from .term_images import thesis_bsdf

    common: dict[str, Any] = {
        "coherence_width": coherence_width, "tolerance": tolerance, "wavelength_range": _RANGE,
    }  # fmt: skip
    backend = "cuda" if (mi.variant() or "").startswith("cuda") else "llvm"

    def seconds(bsdfs: dict[str, Any]) -> dict[str, float]:
        from ..analysis.maps import brdf_map

        best = dict.fromkeys(bsdfs, float("inf"))
        for n in range(_ROUNDS):
            for name, bsdf in bsdfs.items():
                start = time.perf_counter()
                brdf_map(
                    bsdf, light.theta, light.phi, step=step, resolution=resolution,
                    samples=samples, progress=progress,
                )  # fmt: skip
                if n > 0:
                    best[name] = min(best[name], time.perf_counter() - start)
        return best

    with tempfile.TemporaryDirectory(prefix="mitsuba-diffraction-") as folder:
        own, flss = Path(folder) / "own.exr", Path(folder) / "flss.exr"
        DiffractionTable.build(heights, progress=progress, **common).save(own)
        full = make("flss", heights, progress=progress, **common)
        assert isinstance(full, FullSpectrum)
        full.table.save(flss)
        mi.set_variant(f"{backend}_ad_rgb")
        raw: dict[str, Any] = {"material": "none", "energy_conserving": False}
        best = seconds({"colours": quiet_bsdf(own, **raw)})
        mi.set_variant(f"{backend}_ad_spectral")
        best |= seconds({"spectral": quiet_bsdf(own, **raw), "flss": thesis_bsdf(flss, **raw)})
    return Compiled(best["spectral"], best["colours"], best["flss"])
