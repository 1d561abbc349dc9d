"""A flat clear coat over the structure (Dr.Jit): the twin of `optics.coat`, see there."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi

from .pair import Pair
from .reflectance import Conductor, Dielectric
from .roles import Callback, Colour, Float, Interaction, Mask, Vector3f


class CoatedPair(Pair):
    """A pair as it is in a coat.

    `uv` and `w` are optical, those of k in vacuum: `w` is n times the sum of the cosines. All else
    is that of the refracted directions.

    Attributes
    ----------
    n : index of the coat over that of the medium above it.
    """

    def __init__(self, outer: Pair, n: Float) -> None:
        self._outer, self.n = outer, n
        self.wi, self.wo = _refracted(outer.wi, n), _refracted(outer.wo, n)
        self._rotation = outer._rotation
        self.uv = outer.uv
        self.cos_i, self.cos_o = self.wi.z, self.wo.z
        self.w = n * (self.cos_i + self.cos_o)
        self.one_plus_dot = 0.5 * dr.squared_norm(self.wi + self.wo)

    @property
    def outer(self) -> Pair:
        """The pair outside."""
        return self._outer


class UnderCoat:
    """A material under a coat, as far as flat faces go: what light is not transmitted by both."""

    def __init__(self, material: Dielectric | Conductor, coat: Dielectric) -> None:
        self.material, self.coat = material, coat

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """1 − T T / (1 − R R) of coat and material, for the cosine of the angle outside."""
        n = self.coat.eta
        inside = dr.sqrt(dr.maximum(dr.fma(cos_theta, cos_theta, n * n - 1.0), 1e-12)) / n
        face = self.coat.reflectance(cos_theta, si, active)
        beneath = self.material.reflectance(inside, si, active)
        through = (1.0 - face) * (1.0 - beneath)
        # Mirrors that reflect everything let nothing through
        return 1.0 - through * dr.rcp(dr.maximum(1.0 - face * beneath, 1e-6))

    def traverse(self, callback: Callback) -> None:
        """Expose the material's index, and the coat's over that of the medium above it."""
        self.material.traverse(callback)
        self.coat.traverse(callback)

    def settle(self) -> str | None:
        """See `Bounded.settle`."""
        refused = [line for line in (self.material.settle(), self.coat.settle()) if line]
        return "; ".join(refused) or None

    def __str__(self) -> str:
        return f"{self.material} under coat[eta = {dr.slice(self.coat.eta):.5g}]"


def transmittances(cosine: Float, n: Float) -> tuple[Float, Float]:
    """T_s and T_p of the face for light at this angle outside; the same both ways."""
    inside = dr.safe_sqrt(dr.fma(cosine, cosine, n * n - 1.0))
    outside = 4.0 * cosine * inside
    below = dr.fma(n * n, cosine, inside)
    return outside * dr.rcp(dr.square(cosine + inside)), n * n * outside * dr.rcp(dr.square(below))


def bounced(face: tuple[Float, Float], structure: tuple[Float, Float]) -> Float:
    """G of the light that comes and goes, from R of the face and ρ of the structure for both."""
    # At Brewster's angle R is 0 to rounding
    ends = [dr.safe_sqrt(r * rho) for r, rho in zip(face, structure, strict=True)]
    left = dr.fma(-ends[0], ends[1], 1.0)
    return dr.rcp(dr.maximum(left, dr.maximum(*structure) * (1.0 - dr.minimum(*face))))


def _refracted(direction: Vector3f, n: Float) -> Vector3f:
    x, y = direction.x / n, direction.y / n
    # Grazing light would come to lie in the face where the coat is none
    return mi.Vector3f(x, y, dr.sqrt(dr.maximum(1.0 - dr.fma(x, x, y * y), 1e-12)))
