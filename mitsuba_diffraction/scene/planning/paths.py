"""Paths from the camera, and the light that diffracting surfaces reflect along them.

The path tracer combines emitter and BSDF sampling by the power heuristic (Veach 1997, ch. 9). It
runs one bounce after the other, so that each BSDF records its look-ups. Light that reaches the
camera has passed every vertex of its path: it counts at each of them, times the share of
diffraction in the light that the vertex reflects.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...optics.colour import response
from ...plugin.memory import upload
from .recording import RecordedLookups, Session

#: Longest paths that are followed, vertices and camera included.
MOST_BOUNCES = 12
#: The brightest paths count no more than this percentile of those that carry light. A display
#: shows mirror images of the sun as mere white, but their light would outweigh all other.
BRIGHTEST = 99.0


#: A look-up: index of the BSDF among the session's, u, v, w = ωi + ωo in the patch's frame with w
#: times height_scale, wavelength in nm, and the X, Y and Z that it adds to the picture, the light
#: of all paths being 1.
LOOKUP = np.dtype(
    [("bsdf", np.int64), ("u", float), ("v", float), ("w", float), ("wavelength", float),
     ("xyz", float, 3)]
)  # fmt: skip


@dataclass(frozen=True)
class TracedPaths:
    """Look-ups of diffracting surfaces, weighted with the light of the picture."""

    lookups: NDArray[np.void]  # (n,) of type `LOOKUP`
    # (bsdfs,) light of all paths that meet each BSDF, nested BSDFs' included; the light of all
    # paths is 1
    total: NDArray[np.float64]
    paths: int  # how many were traced
    # (bsdfs,) median over pixels of how far ωi turns within a pixel, in direction cosines; NaN
    # where the camera does not see the BSDF
    lobe_turn: NDArray[np.float64]


def trace(scene: Any, sensor: Any, session: Session, paths: int, seed: int = 0) -> TracedPaths:
    """Trace paths through a scene that was loaded in a recording session.

    scene, sensor : of the variant that is set, a spectral one.
    paths : number of paths; two of them share a pixel.

    Raises a DiffractionError if no path carries light.
    """
    paths += paths % 2
    wavelengths, vertices, emitted, directions = _follow(scene, sensor, session, paths, seed)
    colours = _response(sensor, wavelengths)  # (paths, wavelengths, 3)
    reaching = [np.zeros_like(wavelengths)]  # light at a vertex from all vertices after it
    for vertex, light in zip(vertices[::-1], emitted[::-1], strict=True):
        reaching.append(reaching[-1] + light + vertex.direct)
    # emitted[d] is the emission at vertex d, so it counts before that vertex
    whole = (reaching[-1] * colours.sum(axis=2)).sum(axis=1)
    lit = whole > 0.0
    if not lit.any():
        raise DiffractionError(
            f"none of {paths} paths through the scene carries light; check its camera and emitters"
        )
    most = np.percentile(whole[lit], BRIGHTEST)
    weight = np.minimum(1.0, np.divide(most, whole, out=np.ones_like(whole), where=lit))
    weight /= weight @ whole
    parts = [np.empty(0, LOOKUP)]
    met = np.zeros((len(session.bsdfs), paths), bool)
    for number, vertex in enumerate(vertices):
        lights = vertex.direct, reaching[len(vertices) - 1 - number]
        for answer, light in zip(vertex.answers, lights, strict=False):
            returned = _lanes(answer.value, paths)
            for record in answer.records:
                lane = record.lane
                met[record.bsdf, lane] = True
                share = np.divide(
                    record.value, returned[lane], out=np.zeros_like(returned[lane]),
                    where=returned[lane] > 0.0,
                )  # fmt: skip
                asked = np.empty(share.shape, LOOKUP)
                asked["bsdf"], asked["wavelength"] = record.bsdf, wavelengths[lane]
                for name in ("u", "v", "w"):
                    asked[name] = getattr(record, name)[:, None]
                asked["xyz"] = (share * light[lane])[..., None] * colours[lane]
                asked["xyz"] *= weight[lane, None, None]
                parts.append(asked[asked["xyz"].sum(axis=2) > 0.0])
    return TracedPaths(
        lookups=np.concatenate(parts),
        total=met @ (weight * whole),
        paths=paths,
        lobe_turn=_turns(directions, vertices[0], len(session.bsdfs)) if vertices else np.zeros(0),
    )


class _Answer(NamedTuple):
    """Value and density of a BSDF, and the look-ups that it recorded."""

    value: Any
    density: Any
    records: list[RecordedLookups]


class _Vertex(NamedTuple):
    """A bounce: light straight from emitters, and the answers for it and for the next ray."""

    direct: NDArray[np.float64]  # (paths, wavelengths), as it reaches the camera
    answers: tuple[_Answer, ...] = ()


class _Followed(NamedTuple):
    """Paths from the camera to their last vertices."""

    wavelengths: NDArray[np.float64]  # (paths, wavelengths), nm
    vertices: list[_Vertex]
    emitted: list[NDArray[np.float64]]  # light that the ray to each vertex meets at an emitter
    directions: NDArray[np.float64]  # (paths, 2) x and y of ωi at the first vertex


def _follow(scene: Any, sensor: Any, session: Session, paths: int, seed: int) -> _Followed:
    """Trace all paths, one bounce after the other."""
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(dr.opaque(mi.UInt32, seed), paths)  # as a literal it would be part of kernels
    film = sensor.film()
    size, crop, offset = (
        np.array(a, float) for a in (film.size(), film.crop_size(), film.crop_offset())
    )
    rng = np.random.default_rng(seed)
    pixel = np.repeat(np.floor(rng.random((paths // 2, 2)) * crop), 2, axis=0) + offset
    place = mi.Point2f(*(upload(mi.Float, a) for a in (pixel / size).T))
    place += sampler.next_2d() * mi.Vector2f(*(1.0 / float(n) for n in size))
    ray, throughput = sensor.sample_ray(
        0.0, sampler.next_1d(), place, sampler.next_2d(), mi.Mask(True)
    )
    wavelengths = _lanes(ray.wavelengths, paths)
    lane = mi.Float(dr.arange(mi.UInt32, paths))
    context = mi.BSDFContext()
    # Opaque, so that all bounces are the same few kernels
    active, delta = dr.opaque(mi.Mask, True, paths), dr.opaque(mi.Mask, True, paths)
    density = dr.opaque(mi.Float, 1.0, paths)
    before = dr.zeros(mi.SurfaceInteraction3f, paths)
    dr.make_opaque(before)
    sampler.schedule_state()
    dr.eval(ray, throughput)
    vertices: list[_Vertex] = []
    emitted = []
    directions = np.zeros((paths, 2))
    for number in range(_bounces(scene.integrator())):
        si = scene.ray_intersect(mi.Ray3f(ray), mi.RayFlags.All, True, active)
        emitter = si.emitter(scene, active)
        there = mi.DirectionSample3f(scene, si, before)
        by_emitter = scene.pdf_emitter_direction(before, there, active & ~delta)
        share = dr.select(delta, 1.0, _heuristic(density, by_emitter))
        radiance = throughput * emitter.eval(si, active) * share
        emitted.append(_lanes(dr.select(active, radiance, 0.0), paths))
        active &= si.is_valid()
        if number == 0:
            directions = np.stack([_lane(si.wi.x, paths), _lane(si.wi.y, paths)], axis=1)
        dr.eval(si, active, throughput)
        if not dr.any(active):
            break
        bsdf = si.bsdf()
        asked = mi.SurfaceInteraction3f(si)
        asked.time = mi.Float(lane)  # no BSDF looks at the time: it tells which lane a call is of
        sample, radiance = scene.sample_emitter_direction(si, sampler.next_2d(), True, active)
        lit = active & (sample.pdf > 0.0) & dr.any(radiance > 0.0)
        answer = _recorded(session, bsdf, context, asked, si.to_local(sample.d), lit)
        share = dr.select(sample.delta, 1.0, _heuristic(sample.pdf, answer.density))
        direct = dr.select(lit, throughput * radiance * answer.value * share, 0.0)
        drawn, weight = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d(), active)
        delta = mi.has_flag(drawn.sampled_type, mi.BSDFFlags.Delta)
        onward = _recorded(session, bsdf, context, asked, drawn.wo, active & ~delta)
        vertices.append(_Vertex(_lanes(direct, paths), (answer, onward)))
        throughput = throughput * mi.unpolarized_spectrum(weight)
        active &= dr.any(throughput > 0.0)
        density, before = drawn.pdf, si
        ray = si.spawn_ray(si.to_world(drawn.wo))
        sampler.schedule_state()
        dr.eval(ray, throughput, active, density, delta, before)
    # Emitters that the last ray meets are seen from the vertex before it
    vertices += [_Vertex(np.zeros_like(wavelengths))] * (len(emitted) - len(vertices))
    return _Followed(wavelengths, vertices, emitted, directions)


def _recorded(session: Session, bsdf: Any, context: Any, si: Any, wo: Any, active: Any) -> _Answer:
    """Evaluate a BSDF, and record the look-ups of diffracting ones."""
    session.start(dr.width(si))
    try:
        value, pdf = bsdf.eval_pdf(context, si, wo, active)
        dr.eval(value, pdf)
    finally:
        records = session.records()
    return _Answer(mi.unpolarized_spectrum(value), pdf, records)


def _heuristic(a: Any, b: Any) -> Any:
    """The power heuristic's weight of the density a."""
    return dr.select(a > 0.0, dr.square(a) * dr.rcp(dr.square(a) + dr.square(b)), 0.0)


def _lane(value: Any, count: int) -> NDArray[np.float64]:
    return np.broadcast_to(np.array(value, np.float64), (count,))


def _lanes(spectrum: Any, count: int) -> NDArray[np.float64]:
    """Spectrum (count, wavelengths); values that are not finite carry no light."""
    values = np.stack([_lane(spectrum[n], count) for n in range(len(spectrum))], axis=1)
    return np.where(np.isfinite(values), values, 0.0)


def _bounces(integrator: Any) -> int:
    """Return the rays of a path by the integrator's description, at most MOST_BOUNCES."""
    match = re.search(r"max_depth = (-?\d+)", str(integrator))
    depth = int(match[1]) if match else -1
    return MOST_BOUNCES if depth < 0 else min(max(depth, 1), MOST_BOUNCES)


def _response(sensor: Any, wavelengths: NDArray[np.float64]) -> NDArray[np.float64]:
    """Shares of each wavelength in X, Y and Z; all equal for a film of spectral bands."""
    if "SpecFilm" in str(sensor.film()):
        return np.full((*wavelengths.shape, 3), 1.0 / 3.0)
    return response(wavelengths, "E")


def _turns(incident: NDArray[np.float64], first: _Vertex, count: int) -> NDArray[np.float64]:
    """Median of how far ωi turns between the two paths of a pixel, per BSDF."""
    owner = np.full(len(incident), -1)
    for answer in first.answers:
        for record in answer.records:
            owner[record.lane] = record.bsdf
    same = (owner[0::2] == owner[1::2]) & (owner[0::2] >= 0)
    turned = np.hypot(*(incident[0::2] - incident[1::2]).T)
    return np.array(
        [
            float(np.median(turned[pair])) if (pair := same & (owner[0::2] == n)).any() else np.nan
            for n in range(count)
        ]
    )
