"""A scene's light as a shader knows it: directions, points, and a sky that is smooth."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...optics.colour import daylight
from ...plugin.memory import upload
from ...plugin.properties import name_of
from .packing import daylight_colour

Array = NDArray[np.float64]

_SAMPLES = 1024  # of a light that has an extent
_SUN_COSINE = float(np.cos(np.radians(0.6)))  # around the sun's disc, 0.27° in radius


@dataclass(frozen=True)
class Light:
    """One light without extent."""

    name: str  # for people
    place: Array  # (4,) direction towards it and 0, or position and 1
    wavelengths: Array  # (n,) nm
    # irradiance (direction) or intensity (point) relative to D65 of luminance 1, (n,), or (n, 3)
    # where the renderer knows three colours only
    spectrum: Array
    # (3,) what a light shines along, or zeros where it shines alike to all sides
    axis: Array = field(default_factory=lambda: np.zeros(3))
    # cutoff and beam of a spot, angles from its axis in rad; None for a piece of a plane, whose
    # intensity falls with the cosine
    cone: tuple[float, float] | None = None
    # with which a place was drawn on an area light, per area; −1 for a direction drawn from an
    # environment's picture, 0 for what is drawn in no other way (`surroundings`)
    density: float = 0.0
    shape: int = 0  # address of the shape that an area light belongs to; 0 of others

    @property
    def colour(self) -> Array:
        """Linear sRGB (3,)."""
        return daylight_colour(self.wavelengths, self.spectrum)


@dataclass
class Lighting:
    """All of a scene's light, and what of it is shown otherwise or not at all."""

    lights: list[Light] = field(default_factory=list)  # without extent
    # (4, 3) linear sRGB: a plane of normal n gets the irradiance π (sky[0] + Σᵢ nᵢ sky[1 + i])
    sky: Array = field(default_factory=lambda: np.zeros((4, 3)))
    omissions: list[str] = field(default_factory=list)  # in a few words each

    @property
    def mean_spectrum(self) -> tuple[Array, Array]:
        """Of all lights, relative to D65; that itself where only three colours are known."""
        bright = [(light, light.colour.sum()) for light in self.lights]
        spectra = [light.spectrum / total for light, total in bright if total > 0.0]
        if not spectra or spectra[0].ndim > 1:
            return np.array([360.0, 830.0]), np.ones(2)
        return self.lights[0].wavelengths, np.mean(spectra, axis=0)


def read_lights(scene: Any, middle: Array, most: int) -> Lighting:
    """The emitters of a Mitsuba scene.

    Lights with an extent become lights without, with the same irradiance at `middle`: an area
    light a point, the sun of a sky a direction; skies and environments their mean radiance and how
    it changes from one side to the other.

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
    light = without_extent(emitter, middle)
    if light is not None and light.cone is None:
        found.lights.append(light)
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


def without_extent(emitter: Any, middle: Array) -> Light | None:
    """A direction, a point or a spot; None for an emitter of another kind."""
    import mitsuba as mi

    kind, parameters, name = emitter.class_name(), mi.traverse(emitter), name_of(emitter)
    if kind == "DirectionalEmitter":
        wavelengths, spectrum, towards, _ = _sampled(emitter, middle, 1)
        return Light(name, np.append(towards, 0.0), wavelengths, spectrum)
    if kind == "PointLight":
        position = np.array(parameters["position"], float).ravel()
        wavelengths, spectrum, _, _ = _sampled(emitter, position + np.array([0.0, 0.0, 1.0]), 1)
        return Light(name, np.append(position, 1.0), wavelengths, spectrum)
    if kind == "SpotLight":
        to_world = np.array(parameters["to_world"].matrix, float).reshape(4, 4)
        position, axis = to_world[:3, 3], to_world[:3, 2] / np.linalg.norm(to_world[:3, 2])
        wavelengths, spectrum, _, _ = _sampled(emitter, position + axis, 1)
        angles = (float(np.array(parameters[n]).ravel()[0]) for n in ("cutoff_angle", "beam_width"))
        cutoff, beam = (float(np.radians(angle)) for angle in angles)
        return Light(name, np.append(position, 1.0), wavelengths, spectrum, axis, (cutoff, beam))
    return None


def _sampled(
    emitter: Any, at: Array, samples: int, sun: Array | None = None
) -> tuple[Array, Array, Array, float]:
    """Irradiance at a point from one emitter, by Mitsuba's own sampling of it.

    Returns wavelengths (n,), spectrum (n,) or (n, 3), mean direction towards it (3,), mean
    distance.
    """
    values, directions, distances, wavelengths = sampled_directions(emitter, at, samples)
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
    values, directions, _, wavelengths = sampled_directions(emitter, at, _SAMPLES)
    keep = np.ones(len(values)) if without is None else directions @ without <= _SUN_COSINE
    factors = np.column_stack([keep / (4.0 * np.pi), keep[:, None] * directions / (2.0 * np.pi)])
    spectra = np.einsum("sf,swc->fwc", factors, values) / len(values)
    return np.stack(
        [daylight_colour(wavelengths, s[:, 0] if s.shape[1] == 1 else s) for s in spectra]
    )


def sampled_directions(
    emitter: Any, at: Array, samples: int, start: int = 0
) -> tuple[Array, Array, Array, Array]:
    """An emitter as directions from a point, drawn by Mitsuba in proportion to what they bring.

    samples, start : how many, and the number of the first in a sequence that fills the emitter
        evenly.

    Returns irradiance over density (samples, wavelengths, 1 or 3) relative to D65, directions
    (samples, 3), distances (samples,), wavelengths (n,) in nm.
    """
    import drjit as dr
    import mitsuba as mi

    lanes = _Lanes(samples)
    si = dr.zeros(mi.SurfaceInteraction3f, lanes.count)
    si.p = mi.Point3f(*(mi.Float(float(x)) for x in at))
    lanes.set_wavelengths(si)
    drawn, weight = emitter.sample_direction(si, lanes.points(start))
    directions = lanes.vectors(drawn.d)
    distances = np.broadcast_to(np.array(drawn.dist, np.float64).ravel(), (lanes.count,))
    values, wavelengths = lanes.spectra(weight)
    return values, directions, distances[:: lanes.quads], wavelengths


def sampled_positions(
    emitter: Any, samples: int, start: int = 0
) -> tuple[Array, Array, Array, Array]:
    """An area light as points on it, even over its area.

    Returns radiance times area (samples, wavelengths, 1 or 3) relative to D65, positions (samples,
    3), normals (samples, 3), wavelengths (n,) in nm.
    """
    import drjit as dr
    import mitsuba as mi

    lanes = _Lanes(samples)
    drawn, weight = emitter.sample_position(0.0, lanes.points(start))
    si = dr.zeros(mi.SurfaceInteraction3f, lanes.count)
    si.p, si.n, si.uv = drawn.p, drawn.n, drawn.uv
    si.wi = mi.Vector3f(0.0, 0.0, 1.0)
    lanes.set_wavelengths(si)
    values, wavelengths = lanes.spectra(emitter.eval(si) * weight)
    return values, lanes.vectors(drawn.p), lanes.vectors(drawn.n), wavelengths


def radiance_along(emitter: Any, directions: Array) -> Array:
    """What an environment sends from directions (n, 3), linear sRGB (n, 3)."""
    values, waves = spectra_along(emitter, directions)
    if values.shape[2] == 3:
        return values[:, 0]
    weights = np.array([daylight_colour(waves, one) for one in np.eye(len(waves))])
    return np.asarray(values[:, :, 0] @ weights)


def spectra_along(emitter: Any, directions: Array) -> tuple[Array, Array]:
    """The same (n, wavelengths, 1 or 3) relative to D65, and the wavelengths in nm."""
    import drjit as dr
    import mitsuba as mi

    lanes = _Lanes(len(directions))
    si = dr.zeros(mi.SurfaceInteraction3f, lanes.count)
    si.wi = mi.Vector3f(*(lanes.uploaded(-x) for x in directions.T))
    lanes.set_wavelengths(si)
    return lanes.spectra(emitter.eval(si))


def emitted_radiance(shape: Any) -> Array:
    """What a shape emits on average, linear sRGB (3,)."""
    values, _, _, waves = sampled_positions(shape.emitter(), 64)
    mean = values.mean(axis=0) / float(np.array(shape.surface_area()).ravel()[0])
    return daylight_colour(waves, mean[:, 0] if mean.shape[1] == 1 else mean)


class _Lanes:
    """Samples side by side, each once for every four wavelengths."""

    def __init__(self, samples: int) -> None:
        import mitsuba as mi

        self.samples, self.quads = samples, 24 if mi.is_spectral else 1
        self.count = samples * self.quads
        self._waves = np.linspace(360.0, 830.0, 4 * self.quads)

    def set_wavelengths(self, si: Any) -> None:
        """Those of each lane."""
        import mitsuba as mi

        if mi.is_spectral:
            waves = self._waves.astype(np.float32).reshape(4, self.quads)
            each = (np.tile(four, self.samples) for four in waves)
            si.wavelengths = mi.Spectrum(*(upload(mi.Float, four) for four in each))

    def points(self, start: int) -> Any:
        """The plastic number's sequence, even over the square from its middle on (Roberts 2018)."""
        import mitsuba as mi

        number = np.arange(start, start + self.samples)[:, None]
        points = (0.5 + number * [0.7548776662, 0.5698402910]) % 1.0
        return mi.Point2f(*(self.uploaded(p) for p in points.T))

    def uploaded(self, values: Array) -> Any:
        """One number a sample, (samples,)."""
        import mitsuba as mi

        return upload(mi.Float, np.repeat(values, self.quads).astype(np.float32))

    def vectors(self, values: Any) -> Array:
        """(samples, 3)."""
        vectors = np.array(values, np.float64).T.reshape(-1, 3)
        return np.broadcast_to(vectors, (self.count, 3))[:: self.quads]

    def spectra(self, values: Any) -> tuple[Array, Array]:
        """(samples, wavelengths, 1 or 3) relative to D65, and the wavelengths."""
        import mitsuba as mi

        found = np.array(mi.unpolarized_spectrum(values), np.float64)
        found = np.broadcast_to(found.reshape(found.shape[0], -1), (found.shape[0], self.count))
        if not mi.is_spectral:
            return np.repeat(found.T[:, None], 2, axis=1), np.array([360.0, 830.0])
        spectra = found.reshape(4, self.samples, self.quads).transpose(1, 0, 2)
        relative = spectra.reshape(self.samples, -1) / daylight(self._waves)
        return relative[:, :, None], self._waves


def _irradiance(light: Light, at: Array) -> float:
    distance = float(np.linalg.norm(light.place[:3] - at)) if light.place[3] else 1.0
    return float(light.colour.sum()) / distance**2
