"""Boundary models: Jones matrices of a pair of directions, in any arithmetic.

- B is the small-slope approximation of first order (Voronovich 1985), with the coefficients of
  Rice (1951): exact for gentle slopes at any angle as κh → 0.
- K is Kirchhoff's tangent plane, Fresnel's coefficients at the half vector: exact for wide facets
  as the wavelength → 0.

Both are Fresnel's coefficients in the mirror direction (Elfouhaily and Guérin 2004, "A critical
survey of approximate scattering wave theories from random rough surfaces", sections 3 and 4).

Conventions: time is exp(−iωt), so an absorbing index is n + ik with k ≥ 0. Light travels along
d = −ωi, then along d = ωo. The axes are s = ẑ×d/|ẑ×d| and p = d×s, so that (s, p, d) is
right-handed, as Mitsuba's bases are. Along the normal s is taken from the other direction. Then r_s
and r_p of a mirror have opposite signs at normal incidence. A Jones matrix is the tuple of its
entries ss, sp, ps, pp, outgoing polarisation first: E_out = J E_in. All matrices here are J times
2 cosθi cosθo, which stays finite towards the horizon.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

from ..errors import check_choice
from .arithmetic import Number, of, squared
from .blend import RoughnessTable, kirchhoff_weight
from .fresnel import Face, Filmed, Index, amplitudes, faces, normal_reflectance, reflectance

#: Entries ss, sp, ps, pp of a Jones matrix.
Jones: TypeAlias = tuple[Number, Number, Number, Number]
#: A direction, a unit vector: x, y, z.
Direction: TypeAlias = tuple[Number, Number, Number]

#: Squared sines below which a direction is the normal itself, or two directions are one.
SAME_DIRECTION = 1e-20


class Geometry(NamedTuple):
    """A pair of directions, as matrices need it.

    Attributes
    ----------
    cos_i, cos_o : cosθi and cosθo.
    square_i, square_o : squared sines.
    one_plus_dot : 1 + ωi·ωo.
    cos_half : cosine of the angle between either direction and the half vector.
    tilt : cosine of the half vector to the normal of the surface.
    dot, cross : t̂·t̂0 and ẑ·(t̂0×t̂) of the tangential parts t0 of −ωi and t of ωo.
    sines : product of the sines.
    cc, cs, sc, ss : products of cosine or sine of the turn at ωo from the facet's s to s, and of
        the turn at ωi from s to the facet's s. The facet's s is along ωi×ωo.
    """

    cos_i: Number
    cos_o: Number
    square_i: Number
    square_o: Number
    one_plus_dot: Number
    cos_half: Number
    tilt: Number
    dot: Number
    cross: Number
    sines: Number
    cc: Number
    cs: Number
    sc: Number
    ss: Number


class Heights(NamedTuple):
    """Heights of the surface, as a model sees them for a pair of directions and a wavelength.

    Attributes
    ----------
    kappa : κ, phase per height, rad/µm.
    variance : the model's statistic of the heights at the order's frequency q, µm²; σ_q² of eq. 9
        by `roughness`.
    """

    kappa: Number
    variance: Number


def geometry(wi: Direction, wo: Direction) -> Geometry:
    """Return the geometry of directions ωi and ωo, which point away from the surface."""
    (x0, y0, z0), (x, y, z) = wi, wo
    xp = of(x0, x, z0, z)
    sum_x, sum_y, sum_z = x0 + x, y0 + y, z0 + z
    # |ωi + ωo|² = 2(1 + ωi·ωo) is the form that survives opposite grazing directions
    one_plus_dot = 0.5 * (sum_x * sum_x + sum_y * sum_y + sum_z * sum_z)
    cos_half = xp.sqrt(0.5 * one_plus_dot)
    tilt = 0.5 * sum_z * xp.reciprocal(xp.maximum(cos_half, 1e-4))
    square_i, square_o = x0 * x0 + y0 * y0, x * x + y * y
    slanted = (square_i > SAME_DIRECTION) & (square_o > SAME_DIRECTION)
    sines = xp.sqrt(xp.where(slanted, square_i, 1.0)) * xp.sqrt(xp.where(slanted, square_o, 1.0))
    inverse, across = xp.reciprocal(sines), x0 * y - y0 * x
    # t̂0 points against ωi
    dot = xp.where(slanted, -(x0 * x + y0 * y) * inverse, 1.0)
    cross = xp.where(slanted, -across * inverse, 0.0)
    # n = ωi×ωo: n·s and n·p of both directions make the turns
    normal_x, normal_y = y0 * z - z0 * y, z0 * x - x0 * z
    turn0, turn = normal_x * y0 - normal_y * x0, normal_y * x - normal_x * y
    length0, length = turn0 * turn0 + across * across, turn * turn + across * across
    apart = (length0 > SAME_DIRECTION) & (length > SAME_DIRECTION)
    inverse = xp.reciprocal(
        xp.sqrt(xp.where(apart, length0, 1.0)) * xp.sqrt(xp.where(apart, length, 1.0))
    )
    return Geometry(
        z0, z, square_i, square_o, one_plus_dot, cos_half, tilt, dot, cross,
        sines=xp.where(slanted, sines, 0.0),
        # parallel directions: any facet's axis does, s of ωi
        cc=xp.where(apart, turn * turn0 * inverse, dot),
        cs=xp.where(apart, turn * across * inverse, 0.0),
        sc=xp.where(apart, -across * turn0 * inverse, cross),
        ss=xp.where(apart, -across * across * inverse, 0.0),
    )  # fmt: skip


def facets(geometry: Geometry, r_s: Number, r_p: Number) -> Jones:
    """Return U(ωo) diag(r_s, r_p) U(ωi), facets with coefficients r_s and r_p at their own axes."""
    cc, cs, sc, ss = geometry[-4:]
    return (
        r_s * cc - r_p * ss,
        r_s * cs + r_p * sc,
        -(r_s * sc + r_p * cs),
        r_p * cc - r_s * ss,
    )


def kirchhoff(geometry: Geometry, index: Index) -> Jones:
    """Return 2 cosθi cosθo K of the tangent plane, eq. 7.

    Fresnel's coefficients of a facet that mirrors ωi to ωo, between the axes of that facet and
    the axes of the surface, times 1 + ωi·ωo: for unpolarised light ½ Σ|J|² is then
    R(cosθ_half) (1 + ωi·ωo)² (Stam 1999, eq. 7).
    """
    if isinstance(index, Filmed):
        index = index.tilted(geometry.tilt)
    one, cosine = geometry.one_plus_dot, geometry.cos_half
    r_s, r_p = amplitudes(cosine, 1.0 - cosine * cosine, index)
    return facets(geometry, r_s * one, r_p * one)


def kirchhoff_power(geometry: Geometry, index: Index) -> Number:
    """Return ½ Σ|J|² of `kirchhoff`: rotations cancel."""
    if isinstance(index, Filmed):
        index = index.tilted(geometry.tilt)
    one, cosine = geometry.one_plus_dot, geometry.cos_half
    return reflectance(cosine, index) * (one * one)


def small_slope(geometry: Geometry, index: Index) -> Jones:
    """Return 2 cosθi cosθo B of the first-order small-slope approximation, eq. 8.

    With t0, t the tangential parts of −ωi and ωo, γ0, γ their cosines, γ' = √(ε − t²), and unit
    vectors t̂0, t̂ (Rice 1951; Elfouhaily and Guérin 2004, section 4; ε is the index squared):

        B_ss = −(ε−1) (t̂·t̂0)                       / ((γ+γ')(γ0+γ0'))
        B_pp =  (ε−1) (γ' γ0' (t̂·t̂0) − ε |t||t0|)  / ((εγ+γ')(εγ0+γ0'))
        B_ps =  (ε−1) γ'  ẑ·(t̂0×t̂)                 / ((εγ+γ')(γ0+γ0'))    s in, p out
        B_sp =  (ε−1) γ0' ẑ·(t̂0×t̂)                 / ((γ+γ')(εγ0+γ0'))    p in, s out

    By the reciprocity theorem they are products of the fields E0 and E of light along ωi and along
    ωo at the flat interface, (ε−1) (E·E0 tangential + D D0/ε normal) over 4 γ γ0 (Elson 1977,
    Applied Optics 16, 2872). A film that follows the heights has two interfaces, which are
    displaced alike: their products add up. For t = t0 the sums are r_s and r_p of the film.
    """
    ends = zip(
        faces(geometry.cos_i, geometry.square_i, index),
        faces(geometry.cos_o, geometry.square_o, index),
        strict=True,
    )
    first, *others = (_of_face(geometry, came, there) for came, there in ends)
    for other in others:
        first = tuple(a + b for a, b in zip(first, other, strict=True))
    return first


def _of_face(geometry: Geometry, came: Face, there: Face) -> Jones:
    contrast = came.contrast * (2.0 * geometry.cos_i * geometry.cos_o)
    out, bent, into = contrast * there.s, contrast * there.x, contrast * there.p
    return (
        -(out * came.s * geometry.dot),
        out * came.x * geometry.cross,
        bent * came.s * geometry.cross,
        bent * came.x * geometry.dot - into * came.p * came.normal * geometry.sines,
    )


def mixed(first: Jones, second: Jones, weight: Number) -> Jones:
    """Return the second matrix, and as much of the first as its weight says."""
    return tuple((a - b) * weight + b for a, b in zip(first, second, strict=True))


def power(jones: Jones) -> Number:
    """Return N = ½ Σ|J|², the power of unpolarised light of unit power."""
    ss, sp, ps, pp = jones
    return 0.5 * (squared(ss) + squared(sp) + squared(ps) + squared(pp))


def _blended(geometry: Geometry, index: Index, heights: Heights | None) -> Jones:
    """Return 2 cosθi cosθo J of eq. 6, for which `heights` are given."""
    assert heights is not None
    weight = kirchhoff_weight(heights.kappa, heights.variance, normal_reflectance(index))
    return mixed(kirchhoff(geometry, index), small_slope(geometry, index), weight)


def roughness(table: RoughnessTable) -> RoughnessTable:
    """Return σ_q² of a surface, a statistic for models: the table's own."""
    return table


@dataclass(frozen=True)
class Model:
    """A boundary model: a formula in the common arithmetic, for every language.

    Attributes
    ----------
    name : as parameters and commands call the model.
    jones : 2 cosθi cosθo J of a geometry, an index and `Heights`; heights are None where the model
        has no statistic.
    statistic : from the table's σ_q² to the model's own statistic, looked up by q; None of a model
        that does not depend on the heights.
    power : ½ Σ|J|² of the same arguments, where it is shorter than by `jones`.
    """

    name: str
    jones: Callable[[Geometry, Index, Heights | None], Jones]
    statistic: Callable[[RoughnessTable], RoughnessTable] | None = None
    power: Callable[[Geometry, Index], Number] | None = None


#: Boundary models by name. The first is the default of a material with an index.
MODELS: dict[str, Model] = {}


def register(model: Model) -> None:
    """Enter a boundary model in `MODELS`, where every consumer finds it."""
    MODELS[model.name] = model


register(Model("small_slope", _blended, roughness))
register(Model("kirchhoff", lambda g, index, heights: kirchhoff(g, index), power=kirchhoff_power))


def model_of(name: str, models: Iterable[str] = MODELS) -> Model:
    """Return a model by name; refuse an unknown name."""
    return MODELS[checked_model(name, models)]


def checked_model(model: str, models: Iterable[str] = MODELS) -> str:
    """Return the name of a boundary model if it is one of `models`."""
    check_choice("model", model, models)
    return model
