"""Lights of a scene for shaders: directions, points, spots, and a smooth sky."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...optics.colour import daylight, daylight_shares
from ...scene.elements import name_of
from ...shading.spectra import spectra_of, uploaded, vectors_of
from .packing import daylight_colour

_WAVES = np.linspace(360.0, 830.0, 96)  # of spectra of light, nm
_SAMPLES = 1024  # samples of a light with an extent
#: Radius around the sun, rad, whose light is the sun's: its disc has 0.27°.
AROUND_SUN = np.radians(0.6)


@dataclass(frozen=True)
class Lamp:
    """Light without extent: a direction, a point, a spot, or a point on an area light."""

    name: str  # name in messages
    place: Real  # (4,) direction towards it and 0, or position and 1
    wavelengths: Real  # (n,) nm
    # irradiance (direction) or intensity (point) relative to D65 of luminance 1, (n,), or (n, 3)
    # in RGB variants
    spectrum: Real
    # (3,) axis of a spot, or normal of an area light; zeros: equal intensity in all directions
    axis: Real = field(default_factory=lambda: np.zeros(3))
    # cutoff and beam of a spot, angles from its axis in rad; None for a point on an area light,
    # whose intensity is proportional to the cosine
    cone: tuple[float, float] | None = None
    # probability density of a point on an area light, per area, or of a direction drawn from an
    # environment, per solid angle; 0 for lights that lobes do not look up (`surroundings`)
    density: float = 0.0
    shape: int = 0  # address of the area light's shape; 0 for other lights

    @property
    def colour(self) -> Real:
        """Colour in linear sRGB (3,)."""
        return daylight_colour(self.wavelengths, self.spectrum)

    def irradiance(self, point: Real) -> Real:
        """Return the irradiance at a point, linear sRGB (3,), without cosines and cones."""
        away = point - self.place[:3]
        return self.colour / (max(float(away @ away), 1e-12) if self.place[3] else 1.0)


@dataclass
class Lighting:
    """All light of a scene, and the emitters that are simplified or left out."""

    lights: list[Lamp] = field(default_factory=list)  # without extent
    # (4, 3) linear sRGB: a plane of normal n gets the irradiance π (sky[0] + Σᵢ nᵢ sky[1 + i])
    sky: Real = field(default_factory=lambda: np.zeros((4, 3)))
    omissions: list[str] = field(default_factory=list)  # in a few words each

    @property
    def mean_spectrum(self) -> tuple[Real, Real]:
        """Wavelengths and mean spectrum of all lights, relative to D65; 1 in RGB variants."""
        bright = [(light, light.colour.sum()) for light in self.lights]
        spectra = [light.spectrum / total for light, total in bright if total > 0.0]
        if not spectra or spectra[0].ndim > 1:
            return np.array([360.0, 830.0]), np.ones(2)
        return self.lights[0].wavelengths, np.mean(spectra, axis=0)


def read_lights(scene: Any, middle: Real, most: int) -> Lighting:
    """Read the emitters of a Mitsuba scene.

    Lights with an extent become lights without extent, with the same irradiance at `middle`: an
    area light becomes a point, the sun of a sky a direction. Skies and environments are reduced to
    spherical harmonics up to order 1.

    middle : (3,) point at which the irradiance is the same.
    most : largest number of lights; the weakest are left out.
    """
    lighting = Lighting()
    lights, omissions = lighting.lights, lighting.omissions
    for emitter in scene.emitters():
        kind, name = emitter.class_name(), name_of(emitter)
        light = without_extent(emitter, middle)
        if light is not None and light.cone is None:
            lights.append(light)
        elif kind == "AreaLight":
            wavelengths, irradiance, direction, distance = _mean_sample(emitter, middle, _SAMPLES)
            place = np.append(middle + direction * distance, 1.0)
            lights.append(Lamp(name, place, wavelengths, irradiance * distance**2))
            omissions.append(f"the extent of {name} (area light, shown as a point)")
        elif emitter.is_environment():
            sun = sun_of(emitter)
            if sun.any():
                wavelengths, irradiance, *_ = _mean_sample(emitter, middle, 4 * _SAMPLES, sun)
                if irradiance.any():
                    place = np.append(sun, 0.0)
                    lights.append(Lamp(f"sun of {name}", place, wavelengths, irradiance))
                omissions.append(
                    f"the sun's disc and the sky of {name} (a direction, and a smooth sky)"
                )
            elif kind == "EnvironmentMapEmitter":
                omissions.append(f"the picture of {name} (environment, shown as a smooth one)")
            lighting.sky = lighting.sky + _sky(emitter, middle, sun)
        else:
            omissions.append(f"{name} ({kind})")
    if len(lights) > most:
        lights.sort(key=lambda light: -float(light.irradiance(middle).sum()))
        names = ", ".join(light.name for light in lights[most:])
        omissions.append(f"more than {most} lights ({names})")
        del lights[most:]
    return lighting


def sun_of(emitter: Any) -> Real:
    """Return the direction (3,) towards the sun of a sky; zeros for other emitters."""
    import mitsuba as mi

    parameters = mi.traverse(emitter)
    if "sun_direction" not in parameters:
        return np.zeros(3)
    return np.array(parameters["sun_direction"], float).ravel()


def without_extent(emitter: Any, middle: Real) -> Lamp | None:
    """Return a directional, point or spot emitter as a light; None for other kinds."""
    import mitsuba as mi

    kind, parameters, name = emitter.class_name(), mi.traverse(emitter), name_of(emitter)
    if kind == "DirectionalEmitter":
        wavelengths, irradiance, direction, _ = _mean_sample(emitter, middle, 1)
        return Lamp(name, np.append(direction, 0.0), wavelengths, irradiance)
    if kind == "PointLight":
        position = np.array(parameters["position"], float).ravel()
        wavelengths, intensity, *_ = _mean_sample(emitter, position + np.eye(3)[2], 1)
        return Lamp(name, np.append(position, 1.0), wavelengths, intensity)
    if kind == "SpotLight":
        to_world = np.array(parameters["to_world"].matrix, float).reshape(4, 4)
        position, axis = to_world[:3, 3], to_world[:3, 2] / np.linalg.norm(to_world[:3, 2])
        wavelengths, intensity, *_ = _mean_sample(emitter, position + axis, 1)
        angles = (float(np.array(parameters[n]).ravel()[0]) for n in ("cutoff_angle", "beam_width"))
        cutoff, beam = (float(np.radians(angle)) for angle in angles)
        return Lamp(name, np.append(position, 1.0), wavelengths, intensity, axis, (cutoff, beam))
    return None


def _mean_sample(
    emitter: Any, point: Real, samples: int, sun: Real | None = None
) -> tuple[Real, Real, Real, float]:
    """Average Mitsuba's samples of an emitter from a point, or only the samples of its sun.

    Returns wavelengths (n,) in nm, the irradiance (n,) or (n, 3) relative to D65, and the mean
    direction (3,) and distance of the emitter.
    """
    values, directions, distances, wavelengths = sampled_directions(emitter, point, samples)
    if sun is not None:
        values = (values.T * (directions @ sun > np.cos(AROUND_SUN))).T
    weight = values.reshape(samples, -1).sum(axis=1)
    total = weight.sum()
    share = weight / total if total > 0.0 else np.full(len(weight), 1.0 / len(weight))
    direction = share @ directions
    direction /= np.linalg.norm(direction)
    return wavelengths, values.mean(axis=0), direction, float(share @ distances)


def _sky(emitter: Any, point: Real, sun: Real) -> Real:
    """Return `Lighting.sky` of one emitter without its sun: spherical harmonics up to order 1.

    sun : direction towards the sun, or zeros.

    With L = Σ L_lm Y_lm the irradiance is Σ A_l L_lm Y_lm(n), A_0 = π, A_1 = 2π/3 (Ramamoorthi and
    Hanrahan 2001), so E/π = ∫L dω/4π + n·∫L ω dω/2π. This is exact for a constant sky over one
    half, which has no further even orders; odd orders beyond 1 do not contribute.
    """
    values, directions, _, wavelengths = sampled_directions(emitter, point, _SAMPLES)
    included = directions @ sun <= np.cos(AROUND_SUN)
    factors = np.column_stack(
        [included / (4.0 * np.pi), included[:, None] * directions / (2.0 * np.pi)]
    )
    spectra = np.tensordot(factors.T, values, 1) / len(values)
    return np.stack([daylight_colour(wavelengths, spectrum) for spectrum in spectra])


def sampled_directions(
    emitter: Any, point: Real, samples: int, start: int = 0
) -> tuple[Real, Real, Real, Real]:
    """Draw directions from a point to an emitter, by Mitsuba's sampling of its irradiance.

    start : number of the first sample in a sequence that fills the emitter evenly.

    Returns irradiances over density (samples, wavelengths), or (samples, wavelengths, 3) in RGB
    variants, relative to D65; directions (samples, 3), distances (samples,), and wavelengths in nm.
    """
    import mitsuba as mi

    places, drawn = _points(samples, start), list[Any]()

    def draw(si: Any) -> Any:
        si.p = mi.Point3f(*(mi.Float(float(x)) for x in point))
        sample, weight = emitter.sample_direction(si, places)
        drawn.append(sample)
        return weight

    values, wavelengths = _relative(spectra_of(draw, _WAVES, samples))
    distances = np.broadcast_to(np.array(drawn[0].dist, np.float64).ravel(), (samples,))
    return values, vectors_of(drawn[0].d, samples), distances, wavelengths


def sampled_positions(emitter: Any, samples: int, start: int = 0) -> tuple[Real, Real, Real, Real]:
    """Draw points on an area light, evenly over its area.

    Returns radiances times the area as of `sampled_directions`; positions and normals (samples, 3),
    and wavelengths in nm.
    """
    import mitsuba as mi

    sample, weight = emitter.sample_position(0.0, _points(samples, start))

    def leaving(si: Any) -> Any:
        si.p, si.n, si.uv = sample.p, sample.n, sample.uv
        si.wi = mi.Vector3f(0.0, 0.0, 1.0)
        return emitter.eval(si) * weight

    values, wavelengths = _relative(spectra_of(leaving, _WAVES, samples))
    return values, vectors_of(sample.p, samples), vectors_of(sample.n, samples), wavelengths


def radiance_along(emitter: Any, directions: Real) -> Real:
    """Return the radiance of an environment from directions (n, 3), linear sRGB (n, 3)."""
    import mitsuba as mi

    back = mi.Vector3f(*uploaded(-directions))

    def arriving(si: Any) -> Any:
        si.wi = back
        return emitter.eval(si)

    values, waves = _relative(spectra_of(arriving, _WAVES, len(directions)))
    if values.ndim == 3:
        return values[:, 0]
    return values @ daylight_shares(waves)


def _points(samples: int, start: int) -> Any:
    """Return points of the plastic number's sequence in the unit square (Roberts 2018)."""
    import mitsuba as mi

    number = np.arange(start, start + samples)[:, None]
    return mi.Point2f(*uploaded((0.5 + number * [0.7548776662, 0.5698402910]) % 1.0))


def _relative(spectra: NDArray[np.float32]) -> tuple[Real, Real]:
    """Return values as of `sampled_directions` from spectra over `_WAVES`, and the wavelengths."""
    import mitsuba as mi

    values = spectra.astype(np.float64)
    if not mi.is_spectral:
        return np.repeat(values[:, None], 2, axis=1), np.array([360.0, 830.0])
    return values / daylight(_WAVES), _WAVES


def area_of(shape: Any) -> float:
    """Return the area of a shape."""
    return float(np.array(shape.surface_area()).ravel()[0])


def emitted_radiance(shape: Any) -> Real:
    """Return the mean radiance that a shape emits, linear sRGB (3,)."""
    values, _, _, waves = sampled_positions(shape.emitter(), 64)
    return daylight_colour(waves, values.mean(axis=0) / area_of(shape))
