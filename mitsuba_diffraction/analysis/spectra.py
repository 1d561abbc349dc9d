"""Reflectance spectra as a spectrometer with a fibre measures them.

A lamp shines on the surface from one direction, parallel light. A detector collects a cone of
directions. Its signal at one wavelength, per power that falls on the surface, is

    P(λ) = ∫ f(ωi, ωo, λ) cosθo dωo   over the cone.

A white standard, Lambertian of reflectance 1, has f = 1/π. Spectra relative to white are P over
the P of a standard in the same place: the reflectance factor of CIE 15:2018, section 6. Detectors
lie in the plane of incidence: at +θ on the far side of the normal, where a mirror reflects the lamp
of angle θ to, and at −θ on the lamp's side.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Real
from ..errors import DiffractionError, check_choice
from ..llvm import require_loaded_llvm
from ..optics.colour import LONGEST, SHORTEST
from ..optics.geometry import wavenumber
from ..optics.mirror import horizon_correction
from ..plugin.description import VARYING, Consumer, Description, Feature, Surface, describe
from ..plugin.memory import upload
from ..progress import Progress, silent
from .known_wavelengths import check_lit, check_material, known_range
from .maps.evaluate import opaque
from .maps.hemisphere import flat_interaction, vectors
from .spectrometer import MeasurementGeometry, column_name, lobe_width

#: What spectra are relative to: a white standard, a perfect mirror at its own angle, or the light
#: that falls on the surface.
RELATIVE = ("white", "mirror", "none")
#: Spectra are of one place.
SPECTRA = Consumer(
    "a spectrum of one place",
    frozenset(Feature) - VARYING,
    "give a surface with a number in its place, or one part of a mix",
)
#: Default wavelengths: first, last and step, nm.
FIRST, LAST, STEP = 300.0, 830.0, 5.0
# Directions that are measured in one kernel.
_NODES_AT_ONCE = 1 << 18
#: Wavelengths that a spectrum may have.
MAX_WAVELENGTHS = 10_000


@dataclass(frozen=True)
class Spectra:
    """Reflectance spectra of one surface.

    Attributes
    ----------
    wavelength : (n,) nm.
    value : (n, detectors), for unpolarised light; 1 is all of what `relative` names.
    s, p : the same for light polarised across and in the plane of incidence, or None.
    error : standard errors of `value` where it is a mean over several surfaces, or None.
    angular : `angular_variables` of each surface, or empty.
    geometry : angles.
    relative : one of `RELATIVE`.
    """

    wavelength: Real
    value: Real
    geometry: MeasurementGeometry
    relative: str
    s: Real | None = None
    p: Real | None = None
    error: Real | None = None
    angular: tuple[dict[str, float], ...] = ()

    def names(self, group: str = "") -> list[str]:
        """Return names of the detectors' columns, with a group's name before them."""
        return [f"{column_name(group)}_{name}" if group else name for name in self.geometry.names]

    def columns(self, group: str = "") -> dict[str, Real]:
        """Return the spectra by name: each detector's, and its s and p if there are any."""
        columns: dict[str, Real] = {}
        for suffix, values in (("", self.value), ("_s", self.s), ("_p", self.p)):
            if values is not None:
                names = (f"{name}{suffix}" for name in self.names(group))
                columns |= dict(zip(names, values.T, strict=True))
        return columns


def spectrum(
    bsdf: Any,
    light: float = 30.0,
    detectors: Sequence[float] = (30.0,),
    *,
    light_azimuth: float = 0.0,
    acceptance: float = 2.0,
    relative: str = "white",
    wavelengths: ArrayLike | None = None,
    before: Callable[[float], None] | None = None,
    progress: Progress = silent,
) -> Spectra:
    """Return the reflectance spectra of a surface in a spectrometer.

    Raises a DiffractionError if an argument is out of range, or the variant is neither spectral nor
    vectorised.

    Parameters
    ----------
    bsdf : a Mitsuba BSDF of the current variant, spectral and vectorised. In a polarised variant
        the result has s and p as well.
    light : angle of the lamp from the normal, degrees; its light is parallel.
    detectors : angles of the detectors in the plane of incidence, degrees; see
        `MeasurementGeometry`.
    light_azimuth : azimuth of the lamp from the patch's x axis, degrees.
    acceptance : full angle of a detector's cone, degrees.
    relative : "white", relative to a Lambertian standard of reflectance 1; "mirror", relative to a
        perfect mirror, seen where it reflects the lamp to; "none", the share of the incident light
        that enters the detector.
    wavelengths : nm; default: 300 to 830 in steps of 5, as far as table and material are known.
    before : called with each wavelength, nm, before it is measured, to change the BSDF's
        parameters that depend on it, as `media.follow` does.
    progress : called as progress(done, total, text).
    """
    geometry = MeasurementGeometry(
        light, tuple(float(d) for d in detectors), light_azimuth, acceptance
    )
    check_choice("relative", relative, RELATIVE)
    if not mi.is_spectral or "scalar" in mi.variant():
        raise DiffractionError(
            f"variant '{mi.variant()}' does not support spectra; use llvm_ad_spectral, or "
            "llvm_ad_spectral_polarized for s and p"
        )
    require_loaded_llvm()
    sigma = None
    if (described := describe(bsdf)) is not None:
        SPECTRA.check(described)
    lam = check_wavelengths(_usual(described) if wavelengths is None else wavelengths)
    if isinstance(described, Surface):
        sigma = described.sigma
        if described.material:
            check_material(described.material, lam)
        check_lit(described, lam, light, light_azimuth)
    signals = _signals(bsdf, sigma, geometry, lam, before, progress)
    if relative == "white":
        half = math.radians(0.5 * acceptance)
        # ∫ cosθ/π dω over a cone about a direction at θ: cosθ sin²(half)
        angles = np.radians(geometry.detectors)
        signals = signals / (np.cos(angles) * math.sin(half) ** 2)
    elif relative == "mirror":
        signals = signals / _of_mirror(sigma, geometry, lam)
    value, s, p = signals if mi.is_polarized else (signals[0], None, None)
    return Spectra(lam, value, geometry, relative, s, p)


def _usual(described: Description | None) -> Real:
    """Return the default wavelengths (n,), nm, at which a surface is known."""
    lam = np.arange(FIRST, LAST + 1.0, STEP)
    if not isinstance(described, Surface):
        return lam
    (first, last), (low, high) = known_range(described.material or None), described.lit
    return lam[(lam >= max(first, low)) & (lam <= min(last, high))]


def check_wavelengths(wavelengths: ArrayLike) -> Real:
    """Return wavelengths (n,) in nm, increasing; refuse others."""
    lam = np.asarray(wavelengths, np.float64)
    if lam.ndim != 1 or not 1 <= lam.size <= MAX_WAVELENGTHS or not np.isfinite(lam).all():
        raise DiffractionError(
            f"wavelengths must be a list of 1 to {MAX_WAVELENGTHS} numbers, in nm"
        )
    if lam[0] <= 0.0 or not np.all(np.diff(lam) > 0.0):
        raise DiffractionError("wavelengths must be above 0 nm and increase, e.g. 400, 405, 410")
    return lam


def mean_spectra(spectra: Sequence[Spectra]) -> Spectra:
    """Return the mean of spectra of the same wavelengths and geometry, with standard errors.

    The standard error is the standard deviation between the surfaces over the root of their number.
    """
    first = spectra[0]
    if len(spectra) == 1:
        return first
    values = np.stack([each.value for each in spectra])

    def mean_of(parts: Sequence[Real | None]) -> Real | None:
        there = [part for part in parts if part is not None]
        return np.mean(there, axis=0) if there else None

    return replace(
        first,
        value=values.mean(axis=0),
        error=values.std(axis=0, ddof=1) / math.sqrt(len(spectra)),
        s=mean_of([each.s for each in spectra]),
        p=mean_of([each.p for each in spectra]),
        angular=tuple(row for each in spectra for row in each.angular),
    )


def table_range(wavelengths: Real) -> tuple[float, float]:
    """Return the range of a table, nm, for wavelengths (n,) and the light that Mitsuba renders."""
    # Mitsuba loads no table that begins later
    return min(wavelengths[0], SHORTEST), max(wavelengths[-1], LONGEST)


def brdf_values(bsdf: Any, wi: Real, wo: Real, wavelength: Real) -> Real:
    """Return f (n,), 1/sr, of a BSDF at unit vectors (n, 3) and wavelengths (n,) in nm.

    bsdf : of the current variant, spectral and vectorised.
    """
    light, view = vectors(wi), vectors(wo)
    si = flat_interaction(view, len(wo))
    si.wavelengths = mi.UnpolarizedSpectrum(upload(mi.Float, wavelength))
    f = mi.unpolarized_spectrum(bsdf.eval(mi.BSDFContext(), si, light))[0]
    return np.asarray(f, np.float64) / wi[:, 2]


def _signals(
    bsdf: Any,
    sigma: float | None,
    geometry: MeasurementGeometry,
    lam: Real,
    before: Callable[[float], None] | None,
    progress: Progress,
) -> Real:
    """Return P, (1 or 3, n, detectors): unpolarised, and in a polarised variant s and p."""
    lobe, count = lobe_width(sigma, lam), len(geometry.detectors)
    parts, done = [], 0
    while done < count:
        progress(done, count, "detectors")
        cones = [geometry.cone(geometry.detectors[done], lobe)]
        together = max(_NODES_AT_ONCE // len(cones[0][1]), 1)
        following = geometry.detectors[done + 1 : done + together]
        cones += [geometry.cone(angle, lobe) for angle in following]
        parts.append(_integrals(bsdf, geometry, lam, before, cones))
        done += len(cones)
    progress(count, count, "detectors")
    return np.concatenate(parts, axis=-1)


def _integrals(
    bsdf: Any,
    geometry: MeasurementGeometry,
    lam: Real,
    before: Callable[[float], None] | None,
    cones: Sequence[tuple[Real, Real]],
) -> Real:
    """Return ∫ f cosθo dωo over cones of equal numbers of nodes, (1 or 3, n, cones).

    The detector is Mitsuba's camera and the lamp its emitter: `eval` has the lamp's cosine, and its
    Mueller matrix is for light that goes from the lamp to the detector.
    """
    light = geometry.lamp
    directions, weights = map(np.concatenate, zip(*cones, strict=True))
    view = vectors(directions)
    si = flat_interaction(view, len(directions))
    towards = mi.Vector3f(opaque(light))
    turned = (weights * directions[:, 2] / light[2]).reshape(len(cones), -1)
    stokes = _stokes(light, geometry.across)
    context, channels = mi.BSDFContext(), len(mi.UnpolarizedSpectrum())
    packet = channels if before is None else 1
    sums = np.zeros((3 if mi.is_polarized else 1, lam.size, len(cones)))
    for first in range(0, lam.size, packet):
        if before is not None:
            before(float(lam[first]))
        index = np.minimum(first + np.minimum(np.arange(channels), packet - 1), lam.size - 1)
        si.wavelengths = mi.UnpolarizedSpectrum(opaque(lam[index]))
        f = bsdf.eval(context, si, towards)
        parts = [f] if not mi.is_polarized else [f[0, 0], f[0, 1], f[0, 2]]
        dr.eval(parts)
        values = (np.asarray(x, np.float64).reshape(channels, *turned.shape) for x in parts)
        found = np.stack([np.einsum("cdn,dn->cd", each, turned) for each in values])
        used = min(packet, lam.size - first)
        if mi.is_polarized:
            turn = stokes[1] * found[1] + stokes[2] * found[2]
            found = np.stack([found[0], found[0] + turn, found[0] - turn])
        sums[:, first : first + used] = found[:, :used]
    return sums


def _stokes(light: Real, across: Real) -> Real:
    """Return the Stokes vector (3,) of s light from the lamp about Mitsuba's axes of that light."""
    direction = -light
    basis = np.array(mi.mueller.stokes_basis(mi.Vector3f(*direction.tolist())), np.float64).ravel()
    double = 2.0 * math.atan2(across @ np.cross(direction, basis), across @ basis)
    return np.array([1.0, math.cos(double), math.sin(double)])


def _of_mirror(sigma: float | None, geometry: MeasurementGeometry, lam: Real) -> Real:
    """Return P (n, 1) of a perfect mirror of the same coherence, where it reflects the lamp to.

    Its f is f_0 of `optics.mirror` for R = 1.
    """
    if sigma is None:
        return np.ones((lam.size, 1))
    directions, solid = geometry.cone(geometry.light, lobe_width(sigma, lam))
    light = geometry.lamp
    squares = np.square(directions[:, :2] + light[:2]).sum(axis=1)
    weights = (solid * directions[:, 2])[:, None]
    level_i, level_o = sigma * light[2] ** 2, sigma * directions[:, 2] ** 2
    signals = []
    for k in wavenumber(lam):
        lobe = (sigma * k) ** 2 / np.pi * np.exp(-squares * (sigma * k) ** 2)
        signals.append(lobe * horizon_correction(level_i, level_o, k) @ weights)
    return np.array(signals)
