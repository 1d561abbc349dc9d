"""Building methods by name, and their BRDF maps, for comparison with maps of the plugin."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ...analysis.maps import hemisphere
from ...analysis.maps.result import Bands, BrdfMap, LightDirection
from ...errors import check_choice
from ...heights import HeightField
from ...heights.coherence import resolved_width
from ...optics.geometry import wavenumber
from ...progress import Progress, silent
from ...settings import TableSettings
from ...tables import GLOSSY_RADIUS, DiffractionTable, TableSource
from ...tables.build.checks import TAPS_SHARE
from ...tables.window import taps_for
from .method import FullSpectrum, Gain, Method, trapezoid_rule
from .periodic import OrdersOnly, Rainbow, Repeated
from .periods import check_period, required_periods

#: Number of bins that "pq-sinc" reads along each axis.
SINC_TAPS = 8


@dataclass(frozen=True)
class MethodSettings:
    """Settings of the methods.

    Attributes
    ----------
    coherence_width : 4σ of the Gaussian amplitude window, µm, or "auto" (`heights.coherence`); for
        `pq`, the width that is filled with copies of the patch.
    coherence : "patch", one window on the patch's centre, or "ensemble", the mean power of all
        positions. By default "ensemble" for `spectral`, and "patch", as in the thesis, for `flss`
        and `nmm`. `pq` always adds amplitudes; `rainbow` has no window.
    tolerance : tolerance of the tables.
    terms, taps : terms of the Taylor series and taps of the window of `flss`, `nmm` and `pq`; by
        default as many as the tolerance requires. The thesis has 30 and 3: fewer than required are
        accepted with a larger tolerance.
    wavelength_range, step : range and step of the wavelengths of colours, nm.
    period : µm, for `nmm` (along the axis where the patch is most periodic) and `rainbow`; by
        default estimated from the heights.
    repeats : (N₁, N₂) of `pq`; by default as many as fill the coherence width, at least 2.
    nmm_weights, specular : see `OrdersOnly`.
    """

    coherence_width: str | float = "auto"
    coherence: str | None = None
    tolerance: float = 1e-3
    terms: int | None = None
    taps: int | None = None
    wavelength_range: tuple[float, float] = (380.0, 780.0)
    step: float = 5.0
    period: float | None = None
    repeats: tuple[int, int] | None = None
    nmm_weights: str = "step"
    specular: float | None = None

    def __post_init__(self) -> None:
        """Check the wavelengths and the period."""
        trapezoid_rule(self.wavelength_range, self.step)
        if self.period is not None:
            check_period(self.period)


def make(name: str, heights: HeightField, **settings: Any) -> Method:
    """Build the method with a name of `NAMES`; settings as in `make_all`."""
    return make_all((name,), heights, **settings)[name]


def make_all(
    names: Sequence[str],
    heights: HeightField,
    *,
    progress: Progress | None = None,
    **settings: Any,
) -> dict[str, Method]:
    """Build methods by name, for one patch, with shared tables.

    Raises a DiffractionError if a name is unknown, a parameter is not valid, a table cannot be
    built, or the patch has no period and the method needs one.

    Parameters
    ----------
    names : names of `NAMES`.
    heights : the patch, which tiles the plane.
    progress : called as progress(done, total, text) while tables are built.
    settings : fields of `MethodSettings`.
    """
    for name in names:
        check_choice("method", name, NAMES)
    common = MethodSettings(**settings)
    width = resolved_width(common.coherence_width, [heights])

    @functools.cache  # methods share tables
    def table(**changes: Any) -> DiffractionTable:
        arguments = {
            "coherence_width": width, "tolerance": common.tolerance, "height_scale_max": 1.0,
            "wavelength_range": tuple(common.wavelength_range), **changes,
        }  # fmt: skip
        return TableSource.of(heights).table(
            TableSettings(**arguments), progress=progress or silent
        )

    return {name: _MAKERS[name](_Patch(heights, width, common, table), name) for name in names}


class _Patch(NamedTuple):
    """Patch for which methods are built: heights, coherence width (µm), settings and tables."""

    heights: HeightField
    width: float
    settings: MethodSettings
    table: Callable[..., DiffractionTable]  # with the settings of the methods, but for some


def _full(patch: _Patch, name: str) -> FullSpectrum:
    settings = patch.settings
    coherence, series = "ensemble", {}
    if name == "flss":
        coherence = "patch"
        series = {"basis": "taylor", "terms": settings.terms, "taps": settings.taps}
    table = patch.table(coherence=settings.coherence or coherence, **series)
    return FullSpectrum(name, table, settings.wavelength_range, settings.step)


def _nmm(patch: _Patch, name: str) -> OrdersOnly:
    settings = patch.settings
    found = required_periods(patch.heights, name, settings.period)
    lengths = {period.axis: period.length for period in found}
    return OrdersOnly(
        _full(patch, "flss"), (lengths.get("x"), lengths.get("y")),
        weights=settings.nmm_weights, specular=settings.specular,
    )  # fmt: skip


def _pq(patch: _Patch, name: str) -> Repeated:
    settings, extent = patch.settings, patch.heights.extent
    x, y = (max(2, round(patch.width / length)) for length in extent)
    widest = max(extent)  # coherence width of the table, which `Repeated` does not use
    step_x, step_y = (0.5 * math.pi * widest / length for length in extent)
    most = max(SINC_TAPS, *taps_for((step_x, step_y), settings.tolerance * TAPS_SHARE, True))
    copies = patch.table(
        coherence="patch", basis="taylor", terms=settings.terms, coherence_width=widest, taps=most
    )
    return Repeated(
        copies, settings.repeats or (x, y), taps=SINC_TAPS, name=name, step=settings.step,
        interpolation="sinc" if name == "pq-sinc" else "linear",
        wavelength_range=settings.wavelength_range,
    )  # fmt: skip


def _rainbow(patch: _Patch, name: str) -> Rainbow:
    settings = patch.settings
    period = required_periods(patch.heights, name, settings.period)[0]
    return Rainbow(period, coherence_width=patch.width, wavelength_range=settings.wavelength_range)


_MAKERS: dict[str, Callable[[_Patch, str], Method]] = {
    "spectral": _full, "flss": _full, "nmm": _nmm, "pq": _pq, "pq-sinc": _pq,
    "rainbow": _rainbow,
}  # fmt: skip
NAMES = tuple(_MAKERS)


def method_map(
    method: Method,
    light: LightDirection,
    *,
    step: float = 5.0,
    wavelength: float | None = None,
    resolution: int = 128,
    samples: int = 1,
    cosine: bool = False,
    gain: Gain | None = None,
    progress: Progress | None = None,
) -> BrdfMap:
    """Evaluate a method's BRDF for one light direction over the hemisphere of view directions.

    Raises a DiffractionError if a parameter is out of range, or the method has no relative
    reflectance.

    Parameters
    ----------
    method : method, which sums over its wavelengths under D65.
    light : direction to the light.
    step : wavelength step of the method, nm, for the caption.
    wavelength : nm; map f at one wavelength instead of colours.
    resolution : pixels along each axis.
    samples : directions per pixel. Unlike in `brdf_map`, all have the same wavelengths, so that
        errors of a large step are visible.
    cosine : map f·cosθo instead of f.
    gain : map the thesis' relative reflectance with this gain factor instead of f.
    progress : called as progress(done, total, text).
    """
    hemisphere.check_pixels(resolution, samples)
    bands = Bands.choose(method.wavelength_range, step, wavelength)
    rows, columns = np.nonzero(hemisphere.inside(resolution))
    low, size = hemisphere.corners(resolution), 2.0 / resolution
    pattern = hemisphere.sub_samples(samples)
    components = 3 if wavelength is None else 1
    coverage = np.zeros((resolution, resolution), np.float32)
    values = np.zeros((resolution, resolution, components), np.float32)
    x = (low[columns][:, None] + pattern[:, 0] * size).ravel()
    y = (low[rows][:, None] + pattern[:, 1] * size).ravel()
    height = 1.0 - x * x - y * y
    above = height > 0.0
    views = np.stack([x, y, np.sqrt(np.maximum(height, 0.0))], axis=-1)[above]
    lights = np.broadcast_to(light.direction, views.shape)
    if wavelength is None:
        evaluated = method.xyz(lights, views, gain=gain, progress=progress)
    elif gain is None:
        evaluated = method.brdf(lights, views, wavelength)[:, None]
    else:
        evaluated = method.relative(lights, views, wavelength, gain)[:, None]
    if cosine:
        evaluated = evaluated * views[:, 2:]
    sampled = np.zeros((x.size, components))
    sampled[above] = evaluated
    coverage[rows, columns] = above.reshape(-1, samples).mean(axis=1)
    values[rows, columns] = sampled.reshape(-1, samples, components).mean(axis=1)
    return BrdfMap(
        light=light,
        bands=bands,
        coverage=coverage,
        xyz=values if wavelength is None else None,
        spectrum=None if wavelength is None else np.moveaxis(values, -1, 0),
        cosine=cosine,
        illuminant="D65",
        samples=samples,
        lobe=GLOSSY_RADIUS / (method.sigma * float(wavenumber(bands.high))),
    )
