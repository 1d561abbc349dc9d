"""Jones matrices of light that crosses the surface of a dielectric, from above (Dr.Jit).

The twin of `optics.through`, which gives the formulas and their sources.
"""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from .boundary import LEVEL, Jones, turn, turned
from .coat import transmittances
from .crossing import Crossing
from .fresnel import root
from .roles import Vector3f


def crossing_axes(came: Vector3f, left: Vector3f) -> tuple[Vector3f, Vector3f]:
    """s of light along two directions; each other's along the normal (`optics.boundary`)."""
    found = []
    for direction in (came, left):
        square = dr.square(direction.x) + dr.square(direction.y)
        slanted = square > LEVEL
        inverse = dr.rsqrt(dr.select(slanted, square, 1.0))
        found.append((slanted, mi.Vector3f(-direction.y * inverse, direction.x * inverse, 0.0)))
    (is_came, s_came), (is_left, s_left) = found
    s_came = dr.select(is_came, s_came, dr.select(is_left, s_left, mi.Vector3f(0.0, 1.0, 0.0)))
    return s_came, dr.select(is_left, s_left, s_came)


def out_of_sheet(jones: Jones, crossing: Crossing) -> Jones:
    """See `optics.through.out_of_sheet`."""
    left, came = (
        transmittances(cosine, crossing.n) for cosine in (-crossing.below.z, crossing.above.z)
    )
    shares = [t * dr.rcp(dr.fma(-(1.0 - t), 1.0 - other, 1.0)) for t in left for other in came]
    return tuple(entry * dr.sqrt(share) for entry, share in zip(jones, shares, strict=True))


def first_order(crossing: Crossing, axes: tuple[Vector3f, Vector3f], thin: bool) -> Jones:
    """2 cosθi cosθt B (`optics.through.small_slope`)."""
    n, above, inside = crossing.n, crossing.above, crossing.inside
    squares = [dr.square(d.x) + dr.square(d.y) for d in (above, inside)]
    epsilon = n * n
    outer = 1.0 - epsilon * squares[1]
    # Beyond the critical angle light fades outside; from outside it never is there
    q = root(outer if thin else mi.Complex2f(outer, 0.0))
    q0_inside = dr.sqrt(epsilon - squares[0])
    dot = dr.dot(*axes)
    cross = dr.fma(axes[0].x, axes[1].y, -axes[0].y * axes[1].x)
    contrast = (epsilon - 1.0) * -2.0 * above.z * inside.z
    s0, p0 = dr.rcp(crossing.q0 + q0_inside), dr.rcp(epsilon * crossing.q0 + q0_inside)
    s, p = contrast * dr.rcp(q + crossing.q), contrast * n * dr.rcp(epsilon * q + crossing.q)
    sines = n * dr.safe_sqrt(squares[0] * squares[1])
    return (
        s * (s0 * dot),
        -(s * (q0_inside * p0 * cross)),
        q * p * (s0 * cross),
        p * p0 * (q * (q0_inside * dot) + sines),
    )


def tangent_plane(crossing: Crossing, axes: tuple[Vector3f, Vector3f]) -> Jones:
    """2 cosθi cosθt K (`optics.through.kirchhoff`)."""
    n, above, inside = crossing.n, crossing.above, crossing.inside
    total = -(above + n * inside)
    length = dr.norm(total)
    normal = total * dr.rcp(dr.maximum(length, 1e-6))
    cos_in, cos_out = dr.dot(above, normal), -dr.dot(inside, normal)
    refracts = (cos_in > 0.0) & (cos_out > 0.0)
    cos_in = dr.select(refracts, cos_in, 1.0)
    scale = dr.select(refracts, 2.0 * cos_in * cos_out * length, 0.0)
    t_s, t_p = scale * dr.rcp(cos_in + n * cos_out), scale * dr.rcp(n * cos_in + cos_out)
    axis = dr.cross(inside, above)
    square = dr.squared_norm(axis)
    found = square > LEVEL
    axis = dr.select(found, axis * dr.rsqrt(dr.select(found, square, 1.0)), axes[0])
    zero = mi.Float(0.0)
    return turned((t_s, zero, zero, t_p), turn(axes[1], axis, inside), turn(axis, axes[0], -above))
