"""Evaluation of a Mitsuba BSDF over the hemisphere of view directions, with Dr.Jit."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError, check_choice
from ...llvm import require_loaded_llvm
from ...optics.colour import ILLUMINANTS, LONGEST, SHORTEST, linear_srgb, response
from ...optics.geometry import wavenumber
from ...plugin.description import VARYING, Consumer, Feature, Surface, describe
from ...plugin.memory import upload
from ...progress import Progress, silent
from ...tables import GLOSSY_RADIUS
from ..known_wavelengths import check_lit
from . import hemisphere
from .result import Bands, BrdfMap, LightDirection

#: Maps are of one place.
MAPS = Consumer(
    "a map of one place",
    frozenset(Feature) - VARYING,
    "give a surface with a number in its place, or one part of a mix",
)
#: Pixels of a kernel launch: enough for a GPU, with sums of some tens of megabytes.
LAUNCH_PIXELS = 1 << 20
#: Largest number of values in a spectral map, 4 GB.
_MOST_NUMBERS = 1 << 30


def brdf_map(
    bsdf: Any,
    theta: float = 0.0,
    phi: float = 0.0,
    *,
    wavelength_range: tuple[float, float] = (360.0, 830.0),
    step: float = 5.0,
    wavelength: float | None = None,
    resolution: int = 512,
    samples: int | None = None,
    illuminant: str = "D65",
    cosine: bool = False,
    spectral: bool = False,
    progress: Progress | None = None,
) -> BrdfMap:
    """Evaluate the BRDF for one light direction over the hemisphere of view directions.

    Each pixel is the mean over `samples` directions. The spectrum is integrated by the midpoint
    rule over bands of `step`. Each sample of a pixel has another wavelength within the bands, which
    refines the rule by the number of samples, so that orders do not break up into dots.

    In an RGB variant the map has the BSDF's colours under daylight's whole spectrum: one look-up
    per direction, in the table with which such variants render.

    Raises a DiffractionError if a parameter is out of range; if the variant is scalar, or neither
    spectral nor RGB; or if it is RGB and the parameters do not describe the whole spectrum in
    daylight.

    Parameters
    ----------
    bsdf : a Mitsuba BSDF of the current variant, `diffraction` or any other without textures.
    theta, phi : direction to the light, degrees; see `LightDirection`.
    wavelength_range : nm.
    step : largest width of a band, nm.
    wavelength : nm; map f at this wavelength instead of colours.
    resolution : pixels along each axis.
    samples : directions per pixel; by default enough to sample every lobe.
    illuminant : "D65" or "E".
    cosine : map f·cosθo instead of f.
    spectral : store the bands, too.
    progress : called as progress(done, total, text).
    """
    light = LightDirection(theta, phi)
    bands = Bands.choose(wavelength_range, step, wavelength)
    check_choice("illuminant", illuminant, ILLUMINANTS)
    check_map(bands, resolution, samples, spectral)
    check_variant(bands, illuminant, spectral)
    require_loaded_llvm()
    if (described := describe(bsdf)) is not None:
        MAPS.check(described)
    surface = described if isinstance(described, Surface) else None
    # colours of orders that miss visible light are named when their table loads
    if surface is not None:
        named = bands.is_single or spectral or not surface.solved
        check_lit(surface, np.array([bands.low, bands.high] if named else []), theta, phi)
    # σ·k·Δ = 1/√2 is one standard deviation of exp(−σ²k²Δ²)
    sigma = None if surface is None else surface.sigma
    narrowest = 0.5 if sigma is None else 1 / (2**0.5 * sigma * float(wavenumber(bands.low)))
    if samples is None:
        samples = hemisphere.samples_for(resolution, narrowest)
    kept = bands.count if spectral or bands.is_single else 0
    add = partial(_add, bsdf, bands=bands, illuminant=illuminant, cosine=cosine)
    count = (0 if bands.is_single else 3) + kept
    coverage, values = _over_pixels(add, count, light, resolution, samples, progress or silent)
    if mi.is_rgb:
        to_xyz = np.linalg.inv(linear_srgb(np.eye(3)))
        values = np.moveaxis(np.moveaxis(values, 0, -1) @ to_xyz, -1, 0).astype(np.float32)
    return BrdfMap(
        light=light,
        bands=bands,
        coverage=coverage,
        xyz=None if bands.is_single else np.moveaxis(values[:3], 0, -1),
        spectrum=values[count - kept :] if kept else None,
        cosine=cosine,
        illuminant=illuminant,
        samples=samples,
        lobe=0.0 if sigma is None else GLOSSY_RADIUS / (sigma * float(wavenumber(bands.high))),
    )


def check_variant(bands: Bands, illuminant: str, spectral: bool) -> None:
    """Refuse the current variant if the map cannot be evaluated in it."""
    if not (mi.is_spectral or mi.is_rgb) or mi.is_polarized or "scalar" in mi.variant():
        raise DiffractionError(
            f"variant '{mi.variant()}' does not support maps; use llvm_ad_spectral, llvm_ad_rgb, "
            "cuda_ad_spectral or cuda_ad_rgb"
        )
    if mi.is_rgb and (
        (bands.low, bands.high) != (SHORTEST, LONGEST) or spectral or illuminant != "D65"
    ):
        raise DiffractionError(
            f"variant '{mi.variant()}' supports only colours of the whole spectrum in daylight; "
            "leave wavelengths, bands and illuminant out, or use llvm_ad_spectral"
        )


def check_map(bands: Bands, resolution: int, samples: int | None, spectral: bool) -> None:
    """Refuse numbers of pixels, samples and bands that are out of range or need too much memory."""
    hemisphere.check_pixels(resolution, samples)
    if spectral and resolution**2 * bands.count > _MOST_NUMBERS:
        raise DiffractionError(
            f"a spectral map of {resolution}² pixels and {bands.count} bands requires "
            f"{resolution**2 * bands.count * 4 / 1e9:.0f} GB; lower resolution or widen step"
        )


def _add(
    bsdf: Any, totals: list[Any], si: Any, wo: Any, active: Any, offset: float, *,
    bands: Bands, illuminant: str, cosine: bool,
) -> None:  # fmt: skip
    """Add one sample of each pixel to its totals: X, Y, Z, bands, or both; or R, G, B.

    All packets of wavelengths have one kernel. In RGB variants the totals are linear sRGB of the
    whole spectrum.

    Parameters
    ----------
    totals : variables mi.Float; changed in place.
    offset : position of the wavelength in each band, 0 to 1.
    """
    context, over = mi.BSDFContext(), 1.0 if cosine else dr.rcp(wo.z)
    if mi.is_rgb:
        f = bsdf.eval(context, si, wo, active) * over
        for n in range(3):
            totals[n] += f[n]
        dr.eval(totals)
        return
    packet, start = len(mi.Spectrum()), 0 if bands.is_single else 3
    wavelengths = bands.wavelengths(offset)
    weights = response(wavelengths, illuminant) * bands.width
    for first in range(0, bands.count, packet):
        # the last packet is padded with wavelengths of weight 0
        index = np.minimum(np.arange(first, first + packet), bands.count - 1)
        used = min(packet, bands.count - first)
        # opaque, since every literal would compile another kernel
        si.wavelengths = mi.Spectrum(opaque(wavelengths[index]))
        f = bsdf.eval(context, si, wo, active) * over
        padded = weights[index] * (np.arange(packet) < used)[:, None]
        for n in range(start):
            totals[n] += dr.dot(mi.Spectrum(opaque(padded[:, n])), f)
        here = range(start + first, min(start + first + used, len(totals)))
        for n in here:  # an empty list where bands are not kept
            totals[n] += f[n - here.start]
        dr.eval(totals[here.start : here.stop], totals[:3])


def _over_pixels(
    add: Callable[..., None],
    count: int,
    light: LightDirection,
    resolution: int,
    samples: int,
    progress: Progress,
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the means over each pixel: coverage (n, n) and sums (count, n, n) of `add`."""
    inside = hemisphere.inside(resolution)
    low, size = hemisphere.corners(resolution), 2.0 / resolution
    rows, columns = np.nonzero(inside)
    coverage = np.zeros((resolution, resolution), np.float32)
    values = np.zeros((count, resolution, resolution), np.float32)
    pattern = hemisphere.sub_samples(samples)
    chunks = -(-rows.size // LAUNCH_PIXELS)
    for chunk in range(chunks):
        part = slice(chunk * LAUNCH_PIXELS, (chunk + 1) * LAUNCH_PIXELS)
        x0, y0 = (upload(mi.Float, low[index[part]]) for index in (columns, rows))
        hit = dr.zeros(mi.Float, dr.width(x0))
        si = hemisphere.flat_interaction(mi.Vector3f(opaque(light.direction)), dr.width(x0))
        totals = [dr.zeros(mi.Float, dr.width(x0)) for _ in range(count)]
        for n, (shift_x, shift_y, offset) in enumerate(pattern):
            progress(chunk * samples + n, chunks * samples, "evaluating")
            shift = opaque(np.array([shift_x, shift_y]) * size)
            x, y = x0 + shift[0], y0 + shift[1]
            z2 = 1.0 - dr.square(x) - dr.square(y)
            active = z2 > 0.0
            wo = mi.Vector3f(x, y, dr.sqrt(dr.select(active, z2, 1.0)))
            hit += dr.select(active, 1.0, 0.0)
            dr.eval(wo, active, hit)
            add(totals, si, wo, active, float(offset))
            dr.sync_thread()  # so that Ctrl-C need not wait for queued kernels
        coverage[rows[part], columns[part]] = np.array(hit) / samples
        for total, value in zip(totals, values, strict=True):
            value[rows[part], columns[part]] = np.array(total) / samples
    progress(chunks * samples, chunks * samples, "evaluating")
    return coverage, values


def opaque(values: NDArray[np.float64]) -> list[Any]:
    """Return numbers as opaque Dr.Jit variables of one element each, which share a kernel."""
    variables = [mi.Float(float(v)) for v in values]
    dr.make_opaque(variables)
    return variables
