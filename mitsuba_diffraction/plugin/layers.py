"""How much light reaches what lies beneath the diffracting surface (Dr.Jit)."""

from __future__ import annotations

from dataclasses import dataclass

import drjit as dr
import mitsuba as mi

from .coat import UnderCoat
from .film import UnderFilm
from .reflectance import Reflectance
from .roles import Colour, Interaction, Mask, Vector3f

LAYERINGS = ("transmission", "thesis")


@dataclass(frozen=True)
class Transmission:
    """f = f_diffraction + T(ωi) T(ωo) f_nested, T = 1 − a of the diffracting surface.

    a(ω) is the albedo of f_diffraction, so that what is not reflected goes on, and a white pair
    reflects at most what it gets. It is taken as the flat interface's reflectance times their
    ratio, which is smooth; under a coat as the flat reflectance alone.
    """

    fresnel: Reflectance | UnderCoat | UnderFilm
    above = 1.0

    def beneath(
        self, si: Interaction, wo: Vector3f, active: Mask, ratios: tuple[Colour, Colour]
    ) -> Colour:
        """Factor of the nested BSDF; ratios : of ωi and ωo."""
        inwards, outwards = (
            dr.maximum(1.0 - ratio * self.fresnel.reflectance(cosine, si, active), 0.0)
            for ratio, cosine in zip(
                ratios, (mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)), strict=True
            )
        )
        return inwards * outwards

    def __str__(self) -> str:
        return "transmission"


@dataclass(frozen=True)
class Blend:
    """f = (1 − w) f_diffraction + (1 − α + w) f_nested, α = min(|F|, 1): not physical.

    The texture blending of the thesis of 2014 that first rendered these patches in real time, for
    comparisons with its pictures: F is the reflectance at the half vector, w (`diffuse_weight`) a
    constant for which it gives no value. A white pair gains energy, towards grazing angles most.
    """

    fresnel: Reflectance | UnderCoat | UnderFilm
    weight: float

    @property
    def above(self) -> float:
        """Factor of the diffraction."""
        return 1.0 - self.weight

    def beneath(
        self, si: Interaction, wo: Vector3f, active: Mask, ratios: tuple[Colour, Colour]
    ) -> Colour:
        """Factor of the nested BSDF."""
        cos_half = 0.5 * dr.norm(si.wi + wo)
        return 1.0 - self.fresnel.reflectance(cos_half, si, active) + self.weight

    def __str__(self) -> str:
        return f"thesis[diffuse_weight = {self.weight:g}]"


Layering = Transmission | Blend
