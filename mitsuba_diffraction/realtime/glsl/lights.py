"""A scene's light as a shader knows it: directions, points, and a sky that is smooth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import daylight
from ...plugin.names import name_of
from .packing import daylight_colour

Array = NDArray[np.float64]

_SAMPLES = 1024  # of a light that has an extent
_SUN_COSINE = float(np.cos(np.radians(0.6)))  # around the sun's disc, 0.27° in radius


@dataclass(frozen=True)
class Light:
    """One light without extent.

    Attributes
    ----------
    name : for people.
    place : (4,) direction towards it and 0, or position and 1.
    wavelengths : (n,) nm.
    spectrum : irradiance (direction) or intensity (point) relative to D65 of luminance 1, (n,), or
        (n, 3) where the renderer knows three colours only.
    """

    name: str
    place: Array
    wavelengths: Array
    spectrum: Array

    @property
    def colour(self) -> Array:
        """Linear sRGB (3,)."""
        return daylight_colour(self.wavelengths, self.spectrum)


@dataclass
class Lighting:
    """All of a scene's light, and what of it is shown otherwise or not at all.

    Attributes
    ----------
    lights : without extent.
    sky : (4, 3) linear sRGB: a plane of normal n gets the irradiance π (sky[0] + Σᵢ nᵢ sky[1 + i]).
    omissions : in a few words each.
    """

    lights: list[Light] = field(default_factory=list)
    sky: Array = field(default_factory=lambda: np.zeros((4, 3)))
    omissions: list[str] = field(default_factory=list)

    @property
    def mean_spectrum(self) -> tuple[Array, Array]:
        """Of all lights, relative to D65; that itself where only three colours are known."""
        spectra = [light.spectrum / light.colour.sum() for light in self.lights]
        if not spectra or spectra[0].ndim > 1:
            return np.array([360.0, 830.0]), np.ones(2)
        return self.lights[0].wavelengths, np.mean(spectra, axis=0)


def read_lights(scene: Any, middle: Array, most: int) -> Lighting:
    """The emitters of a Mitsuba scene.

    Lights with an extent become lights without, with the same irradiance at `middle`: an area
    light a point, the sun of a sky a direction; skies and environments their mean radiance and how
    it changes from one side to the other.

    Parameters
    ----------
    scene : of the variant that is set.
    middle : (3,) where lights with an extent are looked at from.
    most : lights beyond this number, the weakest, are left out.
    """
    found = Lighting()
    for emitter in scene.emitters():
        _add(found, emitter, middle)
    if len(found.lights) > most:
        found.lights.sort(key=lambda light: -_irradiance(light, middle))
        names = ", ".join(light.name for light in found.lights[most:])
        found.omissions.append(f"more than {most} lights ({names})")
        del found.lights[most:]
    return found


def light_definitions(lights: int, sky: bool, displayed: bool = False) -> dict[str, str]:
    """What a shader's compiler must know of the light: how many without extent, whether any sky.

    displayed : whether the picture goes to a screen, exposed and with the transfer curve of sRGB.
    """
    found = {"LIGHTS_LIT": str(lights)}
    if sky:
        found["SKY"] = ""
    if displayed:
        found["DISPLAYED"] = ""
    return found


def _add(found: Lighting, emitter: Any, middle: Array) -> None:
    import mitsuba as mi

    kind, parameters = emitter.class_name(), mi.traverse(emitter)
    name = name_of(emitter)
    if kind == "DirectionalEmitter":
        wavelengths, spectrum, towards, _ = _sampled(emitter, middle, 1)
        found.lights.append(Light(name, np.append(towards, 0.0), wavelengths, spectrum))
    elif kind == "PointLight":
        position = np.array(parameters["position"], float).ravel()
        beside = position + np.array([0.0, 0.0, 1.0])
        wavelengths, spectrum, _, _ = _sampled(emitter, beside, 1)
        found.lights.append(Light(name, np.append(position, 1.0), wavelengths, spectrum))
    elif kind == "AreaLight":
        wavelengths, spectrum, towards, distance = _sampled(emitter, middle, _SAMPLES)
        place = np.append(middle + towards * distance, 1.0)
        found.lights.append(Light(name, place, wavelengths, spectrum * distance**2))
        found.omissions.append(f"the extent of {name} (area light, shown as a point)")
    elif kind == "ConstantBackgroundEmitter":
        found.sky = found.sky + _sky(emitter, middle)
    elif "sun_direction" in parameters:
        sun = np.array(parameters["sun_direction"], float).ravel()
        wavelengths, spectrum, _, _ = _sampled(emitter, middle, 4 * _SAMPLES, sun)
        if spectrum.any():
            found.lights.append(Light(f"sun of {name}", np.append(sun, 0.0), wavelengths, spectrum))
        found.sky = found.sky + _sky(emitter, middle, sun)
        found.omissions.append(
            f"the sun's disc and the sky of {name} (a direction, and a smooth sky)"
        )
    elif kind == "EnvironmentMapEmitter":
        found.sky = found.sky + _sky(emitter, middle)
        found.omissions.append(f"the picture of {name} (environment, shown as a smooth one)")
    else:
        found.omissions.append(f"{name} ({kind})")


def _sampled(
    emitter: Any, at: Array, samples: int, sun: Array | None = None
) -> tuple[Array, Array, Array, float]:
    """Irradiance at a point from one emitter, by Mitsuba's own sampling of it.

    Returns
    -------
    wavelengths (n,), spectrum (n,) or (n, 3), mean direction towards it (3,), mean distance.
    """
    values, directions, distances, wavelengths = _samples(emitter, at, samples)
    if sun is not None:
        values = values * (directions @ sun > _SUN_COSINE)[:, None, None]
    weight = values.sum(axis=(1, 2))
    total = weight.sum()
    share = weight / total if total > 0.0 else np.full(len(weight), 1.0 / len(weight))
    towards = share @ directions
    spectrum = values.mean(axis=0)
    return (
        wavelengths,
        spectrum[:, 0] if spectrum.shape[1] == 1 else spectrum,
        towards / np.linalg.norm(towards),
        float(share @ distances),
    )


def _sky(emitter: Any, at: Array, without: Array | None = None) -> Array:
    """What `Lighting.sky` says of one emitter: spherical harmonics of its light up to order 1.

    With L = Σ L_lm Y_lm the irradiance is Σ A_l L_lm Y_lm(n), A_0 = π, A_1 = 2π/3 (Ramamoorthi and
    Hanrahan 2001), so E/π = ∫L dω/4π + n·∫L ω dω/2π: exact for a constant sky over one half, whose
    other even orders and all of whose odd ones beyond 1 add nothing.
    """
    values, directions, _, wavelengths = _samples(emitter, at, _SAMPLES)
    keep = np.ones(len(values)) if without is None else directions @ without <= _SUN_COSINE
    factors = np.column_stack([keep / (4.0 * np.pi), keep[:, None] * directions / (2.0 * np.pi)])
    spectra = np.einsum("sf,swc->fwc", factors, values) / len(values)
    return np.stack(
        [daylight_colour(wavelengths, s[:, 0] if s.shape[1] == 1 else s) for s in spectra]
    )


def _samples(emitter: Any, at: Array, samples: int) -> tuple[Array, Array, Array, Array]:
    """Values (samples, wavelengths, 1 or 3) relative to D65, directions, distances, wavelengths."""
    import drjit as dr
    import mitsuba as mi

    # the plastic number's sequence fills the square evenly, from its middle on (Roberts 2018)
    random = (0.5 + np.arange(samples)[:, None] * [0.7548776662, 0.5698402910]) % 1.0
    quads = 24 if mi.is_spectral else 1
    wavelengths = np.linspace(360.0, 830.0, 4 * quads)
    lanes = samples * quads
    si = dr.zeros(mi.SurfaceInteraction3f, lanes)
    si.p = mi.Point3f(*(mi.Float(float(x)) for x in at))
    if mi.is_spectral:
        four = wavelengths.reshape(4, quads)
        si.wavelengths = mi.Spectrum(*(mi.Float(np.tile(w, samples)) for w in four))
    points = np.repeat(random, quads, axis=0).astype(np.float32)
    sample = mi.Point2f(*(mi.Float(np.ascontiguousarray(p)) for p in points.T))
    drawn, weight = emitter.sample_direction(si, sample)
    directions = np.array(drawn.d, np.float64).T.reshape(-1, 3)
    distances = np.array(drawn.dist, np.float64).ravel()
    values = np.array(mi.unpolarized_spectrum(weight), np.float64)
    values = np.broadcast_to(values.reshape(values.shape[0], -1), (values.shape[0], lanes))
    directions = np.broadcast_to(directions, (lanes, 3))[::quads]
    distances = np.broadcast_to(distances, (lanes,))[::quads]
    if mi.is_spectral:
        spectra = values.reshape(4, samples, quads).transpose(1, 0, 2).reshape(samples, -1)
        return (spectra / daylight(wavelengths))[:, :, None], directions, distances, wavelengths
    ends = np.array([360.0, 830.0])
    return np.repeat(values.T[:, None], 2, axis=1), directions, distances, ends


def _irradiance(light: Light, at: Array) -> float:
    distance = float(np.linalg.norm(light.place[:3] - at)) if light.place[3] else 1.0
    return float(light.colour.sum()) / distance**2
