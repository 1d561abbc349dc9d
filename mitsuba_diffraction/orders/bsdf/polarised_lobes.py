"""Mueller matrices of solved orders, in polarised variants (Dr.Jit).

The axes are defined in `orders.polarised`.
Light goes from ωi to ωo; where radiance is followed, it comes the other way, and the Jones matrix
is transposed (de Hoop 1960, Appl. Sci. Res. B 8, 135).

Under a coat, light passes the face with √T_s and √T_p on both ways. Light that the face sends back
to the grating is taken to be depolarised.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from ...optics.boundary import Jones
from ...optics.coat import refracted, transmittances
from ...optics.fresnel import amplitudes
from ...plugin.arithmetic import maximum, minimum
from ...plugin.boundary import mueller, polarisation_axes, turn, turned
from ...plugin.directions import Pair
from ...plugin.types import Context, Float, Spectrum, Vector3f
from ..polarised import nearest_jones
from .lobes import Lit, SpectralLobes

_MIN_DIVISOR, _MIN_POWER = 1e-12, 1e-30


class PolarisedLobes(SpectralLobes):
    """Lobes with the Mueller matrices of a polarised table."""

    def spectrum(self, pair: Pair, ctx: Context, lit: list[Lit]) -> Spectrum:
        """See `SpectralLobes.spectrum`."""
        index = self.lookup.index
        path, y = _Path(pair, ctx, index), pair.incident.y * (-1.0 / index)
        total, left = mi.Spectrum(0.0), [light.value for light in lit]
        faces = [mi.Float(0.0) for _ in lit]
        for number in range(len(lit[0].terms)):
            jones = []
            for n, light in enumerate(lit):
                order, lobe, efficiency = light.terms[number]
                elements = self.lookup.elements(light.row, order, y, active := lobe > 0.0)
                lobe = lobe * light.peak
                # share that came from the grating once; the rest is depolarised
                face, share = mi.Float(0.0), mi.Float(1.0)
                if self.lookup.coated:
                    within = self.lookup.repeated(light.row, order, active & light.row.lit)
                    share = minimum(elements[0] * dr.rcp(maximum(within, _MIN_DIVISOR)), 1.0)
                    face = dr.select(order == 0.0, light.row.face, 0.0)
                power = maximum(efficiency - face, 0.0) * lobe * share
                faces[n] = dr.fma(face, lobe, faces[n])
                left[n] -= power
                root = dr.sqrt(maximum(power, _MIN_POWER))  # has a derivative
                jones.append(tuple(entry * root for entry in nearest_jones(elements)))
            total += path.diffracted(jones)
        if self.lookup.coated:
            rest = [maximum(a - b, 0.0) for a, b in zip(left, faces, strict=True)]
            total += path.mirrored(faces) + mi.depolarizer(mi.UnpolarizedSpectrum(rest))
        return total


class _Path:
    """Light of a pair of directions, and the axes that Jones matrices are about."""

    def __init__(self, pair: Pair, ctx: Context, index: float) -> None:
        grooves = pair.frame.from_table(mi.Vector2f(0.0, 1.0))
        self._grooves = mi.Vector3f(grooves.x, grooves.y, 0.0)
        self._ends = -pair.wi, pair.wo
        self._reversed = ctx.mode == mi.TransportMode.Radiance
        self._index, self._cosine = index, pair.cos_i
        if index != 1.0:
            self._faces = self._passage(-pair.wi, True), self._passage(pair.wo, False)

    def diffracted(self, matrices: list[Jones]) -> Spectrum:
        """Return the Mueller matrices of the grating's Jones matrices, under its coat."""
        if self._index != 1.0:
            into, out = self._faces
            matrices = [_product(out, _product(jones, into)) for jones in matrices]
        return self._mueller(matrices, (self._axis(self._ends[0]), self._axis(self._ends[1])))

    def mirrored(self, powers: list[Float]) -> Spectrum:
        """Return the Mueller matrices of the coat's face, of mean reflected powers."""
        r_s, r_p = amplitudes(self._cosine, 1.0 - dr.square(self._cosine), self._index)
        inverse = dr.rsqrt(maximum(0.5 * (dr.square(r_s) + dr.square(r_p)), _MIN_DIVISOR))
        roots = [dr.sqrt(power) * inverse for power in powers]
        zero = mi.Float(0.0)
        s, _ = polarisation_axes(*self._ends)
        matrices = [(r_s * root, zero, zero, r_p * root) for root in roots]
        return self._mueller(matrices, (s, _across(s, self._ends[1])))

    def _mueller(self, matrices: list[Jones], axes: tuple[Vector3f, Vector3f]) -> Spectrum:
        if not self._reversed:
            return mueller(matrices, self._ends, axes)
        # p of the reversed light is the other way
        matrices = [(ss, -ps, -sp, pp) for ss, sp, ps, pp in matrices]
        return mueller(matrices, (-self._ends[1], -self._ends[0]), axes[::-1])

    def _axis(self, direction: Vector3f) -> Vector3f:
        """Return the direction of the grooves, made perpendicular to the light."""
        return _across(self._grooves, direction)

    def _passage(self, outside: Vector3f, enters: bool) -> Jones:
        """Return the Jones matrix of the coat's face between the axes outside and inside."""
        sign = -1.0 if enters else 1.0
        inside = sign * mi.Vector3f(*refracted(sign * outside, mi.Float(self._index)))
        powers = transmittances(dr.abs(outside.z), mi.Float(self._index))
        inverse = dr.rcp(maximum(0.5 * (powers[0] + powers[1]), _MIN_DIVISOR))
        through_s, through_p = (dr.sqrt(power * inverse) for power in powers)
        s, zero = polarisation_axes(outside, outside)[0], mi.Float(0.0)
        first, last = (outside, inside) if enters else (inside, outside)
        return turned(
            (through_s, zero, zero, through_p),
            turn(self._axis(last), s, last),
            turn(s, self._axis(first), first),
        )


def _across(axis: Vector3f, direction: Vector3f) -> Vector3f:
    """Return a unit vector, made perpendicular to a direction."""
    across = dr.fma(direction, -dr.dot(axis, direction), axis)
    return across * dr.rsqrt(maximum(dr.squared_norm(across), _MIN_DIVISOR))


def _product(a: Jones, b: Jones) -> Jones:
    """Return the matrix product."""
    return (
        a[0] * b[0] + a[1] * b[2], a[0] * b[1] + a[1] * b[3],
        a[2] * b[0] + a[3] * b[2], a[2] * b[1] + a[3] * b[3],
    )  # fmt: skip
