"""Sweeps of one parameter, as in the thesis: a BRDF map for each value, compared and timed.

Each map is compared with the one of the reference value. `time_compiled` times the default look-up
against `flss`, both compiled by Dr.Jit.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from ..analysis.maps.result import BrdfMap, LightDirection
from ..errors import DiffractionError
from ..heights import HeightField
from ..optics.colour import delta_e
from ..progress import Progress
from ..tables import DiffractionTable
from .methods import NAMES, FullSpectrum, Gain, Method, make, make_all
from .methods.make import method_map

#: Largest number of maps, which one contact sheet shows.
_MOST_VALUES = 24
# Luminance above which a pixel is lit, relative to the brightest away from the mirror direction.
_LIT = 1e-4

#: Rounds of timing, in each of which every look-up is timed once; the first only warms up.
_ROUNDS = 3
# Wavelengths of Mitsuba's spectral variants, nm.
_RANGE = (360.0, 830.0)


@dataclass(frozen=True)
class _Kind:
    """Unit, default values and reference of a sweep's parameter."""

    unit: str  # printed after values
    values: tuple[Any, ...]  # default values
    # value that the others are compared with, or `None`: the maps differ by intent
    reference: Any


SWEEPS: dict[str, _Kind] = {
    "wavelength-step": _Kind(" nm", (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0), "smallest"),
    "coherence-width": _Kind(" µm", (30.0, 45.0, 65.0, 100.0), "largest"),
    "terms": _Kind(" terms", (2, 4, 6, 8, 10, 12, 15, 18), "largest"),
    "light-angle": _Kind("°", (0.0, 15.0, 30.0, 45.0, 60.0, 75.0), None),
    "method": _Kind("", NAMES, "flss"),
}


class MapDifference(NamedTuple):
    """Difference of a map from the reference over the pixels that the reference lights.

    All values are NaN without a reference.
    """

    delta_e: float = np.nan  # mean ΔE2000 (`colour.delta_e`)
    delta_e_95: float = np.nan  # 95th percentile
    # mean ΔE2000 when each map has its own exposure: difference of colour, not of brightness
    delta_e_own_exposure: float = np.nan
    # ΣZ/ΣX over that of the reference, away from the mirror direction's lobe; above 1 is bluer
    blueness: float = np.nan


@dataclass(frozen=True, eq=False)
class Step:
    """Map of one value of the parameter, and its difference from the reference."""

    value: Any
    label: str  # the value with its unit
    map: BrdfMap
    seconds: float  # time of the map, without that of tables
    difference: MapDifference = field(default_factory=MapDifference)

    def compared(self, reference: BrdfMap) -> Step:
        """Return the step with its difference from the map `reference`."""
        return replace(self, difference=_difference(reference, self.map))


@dataclass(frozen=True, eq=False)
class Sweep:
    """All steps of a sweep, and the label of the reference."""

    kind: str
    steps: tuple[Step, ...]
    reference: str | None


def sweep(
    kind: str,
    heights: HeightField,
    light: LightDirection,
    *,
    values: Sequence[Any] | None = None,
    method: str = "flss",
    resolution: int = 128,
    samples: int = 1,
    gain: Gain | None = None,
    progress: Progress | None = None,
    **settings: Any,
) -> Sweep:
    """Evaluate a BRDF map for every value of a parameter and compare them.

    Raises a DiffractionError if a name or value is not valid.

    Parameters
    ----------
    kind : one of `SWEEPS`.
    heights : the patch.
    light : direction to the light; a sweep over its angle keeps the azimuth.
    values : values of the parameter; by default from `SWEEPS`.
    method : method of the maps, except in a sweep over methods; `terms` requires "flss".
    resolution, samples, gain : see `methods.method_map`.
    progress : called as progress(done, total, text).
    settings : parameters of `methods.make_all`; coherence is "patch" by default in a sweep over
        methods.
    """
    if kind not in SWEEPS:
        raise DiffractionError(f"sweep '{kind}' is unknown; choose one of {', '.join(SWEEPS)}")
    chosen = tuple(SWEEPS[kind].values if values is None else values)
    if not 1 <= len(chosen) <= _MOST_VALUES:
        raise DiffractionError(f"{len(chosen)} values are to be swept; give 1 to {_MOST_VALUES}")
    if gain is not None and ("rainbow" in chosen or method == "rainbow"):
        raise DiffractionError("method 'rainbow' has no relative reflectance; leave it out")
    setups = _setups(kind, chosen, heights, light, method, progress, settings)
    common: dict[str, Any] = {
        "resolution": resolution, "samples": samples, "gain": gain, "progress": progress,
    }  # fmt: skip
    steps = [
        Step(value, label_of(kind, value), *timed_map(one, towards, step=step, **common))
        for value, (one, towards, step) in zip(chosen, setups, strict=True)
    ]
    reference = _reference(SWEEPS[kind].reference, chosen)
    if reference is None:
        return Sweep(kind, tuple(steps), None)
    base = steps[reference]
    return Sweep(kind, tuple(step.compared(base.map) for step in steps), base.label)


def timed_map(method: Method, light: LightDirection, **arguments: Any) -> tuple[BrdfMap, float]:
    """Evaluate a map (arguments as in `methods.method_map`); return it, and its seconds."""
    start = time.perf_counter()
    brdf_map = method_map(method, light, **arguments)
    return brdf_map, time.perf_counter() - start


def _setups(
    kind: str, values: Sequence[Any], heights: HeightField, light: LightDirection, method: str,
    progress: Progress | None, settings: dict[str, Any],
) -> list[tuple[Method, LightDirection, float]]:  # fmt: skip
    """Return method, light and step (nm) of each value; tables are shared where it allows that."""
    step = float(settings.get("step", 5.0))
    settings = {"progress": progress} | settings

    def build(**changes: Any) -> Method:
        """Build the method with the settings and these changes."""
        return make(method, heights, **(settings | changes))

    if kind == "method":
        # one coherence for all, so that only the methods differ
        settings.setdefault("coherence", "patch")
        by_name = make_all(values, heights, **settings)
        return [(by_name[name], light, step) for name in values]
    if kind == "light-angle":
        lights = [LightDirection(float(value), light.phi) for value in values]
        shared = build()
        return [(shared, direction, step) for direction in lights]
    if kind == "wavelength-step":
        return [(build(step=float(v)), light, float(v)) for v in values]
    if kind == "coherence-width":
        return [(build(coherence_width=float(v)), light, step) for v in values]
    if method != "flss":
        raise DiffractionError(
            f"a sweep over terms needs method 'flss', whose series is Taylor's; not '{method}'"
        )
    full = build()
    assert isinstance(full, FullSpectrum)
    span = full.wavelength_range
    return [
        (FullSpectrum("flss", truncated(full.table, v), span, step), light, step) for v in values
    ]


def truncated(table: DiffractionTable, terms: int) -> DiffractionTable:
    """Truncate the Taylor series of a table to `terms` terms, if it has more."""
    if terms != int(terms) or terms < 1:
        raise DiffractionError(f"terms={terms} must be a whole number, at least 1")
    count = min(int(terms), table.expansion.terms)
    return replace(
        table,
        coefficients=table.coefficients[..., :count],
        order_0=table.order_0[..., :count],
        expansion=replace(table.expansion, terms=count),
    )


def _reference(rule: str | None, values: Sequence[Any]) -> int | None:
    """Return the index of the reference value, if the sweep has one."""
    if rule in ("smallest", "largest"):
        return int(np.argmin(values) if rule == "smallest" else np.argmax(values))
    return values.index(rule) if rule in values else None


def label_of(kind: str, value: Any) -> str:
    """Return a value with its unit."""
    return f"{value}" if kind == "method" else f"{value:g}{SWEEPS[kind].unit}"


def _difference(base: BrdfMap, other: BrdfMap) -> MapDifference:
    """Compare a map with the map `base`."""
    assert base.xyz is not None
    assert other.xyz is not None
    away = base.away_from_mirror()
    luminance = base.luminance.astype(np.float64)
    if not luminance.max() > 0.0:
        return MapDifference()
    # a grating is dark nearly everywhere, so only the pixels that it lights count
    bright = np.percentile(luminance[away], 99.9)
    lit = luminance > _LIT * bright
    first, second = (m.linear[lit].astype(np.float64) for m in (base, other))
    same_exposure = delta_e(first, second)
    levels = [np.percentile(m.luminance[lit], 95.0) for m in (base, other)]
    own_exposure = delta_e(first, second * (levels[0] / levels[1] if levels[1] > 0.0 else 1.0))
    shares = [m[away].sum(axis=0, dtype=np.float64) for m in (base.xyz, other.xyz)]
    blue = [share[2] / share[0] if share[0] > 0.0 else np.nan for share in shares]
    return MapDifference(
        delta_e=float(np.nanmean(same_exposure)),
        delta_e_95=float(np.nanpercentile(same_exposure, 95.0)),
        delta_e_own_exposure=float(np.nanmean(own_exposure)),
        blueness=float(blue[1] / blue[0]),
    )


@dataclass(frozen=True)
class Compiled:
    """Seconds of one compiled map, the smallest of all rounds."""

    spectral: float  # default look-up at every wavelength
    colours: float  # RGB variants: one look-up in the table of the whole spectrum's colours
    flss: float  # the thesis' loop over wavelengths, terms and taps, one image per term

    @property
    def ratio(self) -> float:
        """Time of `flss` relative to the default look-up at every wavelength."""
        return self.flss / self.spectral

    @property
    def colour_ratio(self) -> float:
        """Time of `flss` relative to the default look-up in colours."""
        return self.flss / self.colours


def time_compiled(
    heights: HeightField,
    light: LightDirection,
    *,
    resolution: int,
    samples: int,
    step: float = 5.0,
    coherence_width: str | float = "auto",
    tolerance: float = 1e-3,
    progress: Progress | None = None,
) -> Compiled:
    """Time one map of the whole spectrum by three look-ups, without building tables.

    The function sets the variants llvm_ad_rgb and llvm_ad_spectral, or the CUDA variants
    if one is current, and leaves the spectral one set.

    Raises a DiffractionError if a parameter is out of range or a table cannot be built.
    """
    import mitsuba as mi

    from ..analysis.timing import quiet_bsdf
    from .term_images import thesis_bsdf

    common: dict[str, Any] = {
        "coherence_width": coherence_width, "tolerance": tolerance, "wavelength_range": _RANGE,
    }  # fmt: skip
    backend = "cuda" if (mi.variant() or "").startswith("cuda") else "llvm"

    def seconds(bsdfs: dict[str, Any]) -> dict[str, float]:
        """Return the shortest time of each BSDF's map."""
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

    default = DiffractionTable.build(heights, progress=progress, **common)
    full = make("flss", heights, progress=progress, **common)
    assert isinstance(full, FullSpectrum)
    mi.set_variant(f"{backend}_ad_rgb")
    raw: dict[str, Any] = {"material": "none", "energy_conserving": False}
    best = seconds({"colours": quiet_bsdf(default, **raw)})
    mi.set_variant(f"{backend}_ad_spectral")
    flss = thesis_bsdf(full.table, **raw)
    best |= seconds({"spectral": quiet_bsdf(default, **raw), "flss": flss})
    return Compiled(best["spectral"], best["colours"], best["flss"])
