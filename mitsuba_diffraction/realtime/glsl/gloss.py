"""What plain BSDFs of Mitsuba mirror, and what they let through to their diffuse base."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...plugin.changing import children
from .packing import pack_conductor
from .texels import Packed, Texture

_COSINES = 64
_KINDS = ("RoughPlastic", "SmoothPlastic", "RoughConductor", "SmoothConductor", "Principled")
#: Parts of the principled BSDF that are not drawn.
_LEFT_OUT = ("spec_trans", "anisotropic", "sheen", "flatness", "clearcoat", "spec_tint")


@dataclass(frozen=True)
class Gloss:
    """A face that mirrors.

    Attributes
    ----------
    bsdf : of Mitsuba.
    alpha : roughness; 0 of a smooth face.
    ggx : whether facets are distributed as GGX, else as Beckmann.
    through : (n,) what it lets through at cosines even from 0 to 1, None of a metal and the
        principled BSDF: the base has the BRDF ρ/π times those of both directions.
    omissions : what of it is not drawn, in a few words each.
    """

    bsdf: Any
    alpha: float
    ggx: bool
    through: NDArray[np.float64] | None
    omissions: tuple[str, ...] = ()

    @classmethod
    def of(cls, bsdf: Any) -> Gloss | None:
        """That of a BSDF, or None for a kind that is not known here."""
        import mitsuba as mi

        if bsdf.class_name() not in _KINDS:
            return None
        if bsdf.class_name() == "Principled":
            left_out = (name.replace("_", " ") for name in _LEFT_OUT if _mean(bsdf, name) > 0.0)
            alpha = max(_mean(bsdf, "roughness") ** 2, 1e-3)  # as Mitsuba has it
            return cls(bsdf, alpha, True, None, tuple(f"the {part}" for part in left_out))
        parameters = mi.traverse(bsdf)
        alpha = next((parameters[n] for n in ("alpha", "alpha.value") if n in parameters), 0.0)
        if bsdf.class_name().startswith("Rough") and not np.any(alpha):
            return None  # another one along each axis, or a picture
        metal = bsdf.class_name().endswith("Conductor")
        through = None if metal else _through(bsdf)
        rough = float(np.array(alpha).ravel()[0])
        return cls(bsdf, rough, "distribution = ggx" in str(bsdf), through)

    @property
    def pigment(self) -> Any:
        """The texture of the diffuse base, None of a metal."""
        found = children(self.bsdf)
        return found.get("diffuse_reflectance", found.get("base_color"))

    def packed(self, spectra: Any) -> Packed:
        """For shaders/gloss.glsl.

        spectra : turns two textures into wavelengths and their values over them.
        """
        import mitsuba as mi

        definitions = {"GLOSS": ""} | ({"GGX": ""} if self.ggx else {})
        if self.alpha == 0.0:
            definitions["MIRROR"] = ""
        found = Packed((), {"gloss_alpha": self.alpha}, definitions)
        if self.bsdf.class_name() == "Principled":
            return found | _principled(self.bsdf)
        parts = children(self.bsdf)
        if self.through is None:
            return found | pack_conductor(*spectra(parts["eta"], parts["k"]))
        eta = float(np.array(mi.traverse(self.bsdf)["eta"]).ravel()[0])
        rows = np.repeat(self.through.reshape(1, -1, 1), 4, axis=2).astype(np.float32)
        face = Packed(
            (Texture("through", rows),), {"eta": eta}, {"SURFACE_KIND": "1", "THROUGH": ""}
        )
        return found | face


def _mean(bsdf: Any, name: str) -> float:
    """Of one of its textures."""
    return float(np.array(children(bsdf)[name].mean()).ravel()[0])


def _principled(bsdf: Any) -> Packed:
    """Of the principled BSDF what is not its roughness alone."""
    import mitsuba as mi

    parameters = mi.traverse(bsdf)
    if "eta" in parameters:
        eta = float(np.array(parameters["eta"]).ravel()[0])
    else:
        specular = float(np.array(parameters["specular"]).ravel()[0])
        eta = 2.0 / (1.0 - np.sqrt(0.08 * specular)) - 1.0  # as Mitsuba has it
    return Packed(
        (),
        {"eta": eta, "metallic": _mean(bsdf, "metallic"), "roughness": _mean(bsdf, "roughness")},
        {"SURFACE_KIND": "1", "PRINCIPLED": ""},
    )


def _through(bsdf: Any) -> NDArray[np.float64]:
    """From the diffuse part of Mitsuba's own values."""
    import drjit as dr
    import mitsuba as mi

    cosines = np.maximum(np.linspace(0.0, 1.0, _COSINES), 1e-3)
    context = mi.BSDFContext()
    context.type_mask = mi.BSDFFlags.Diffuse
    si = dr.zeros(mi.SurfaceInteraction3f, _COSINES)
    if mi.is_spectral:
        si.wavelengths = mi.Spectrum(550.0)
    si.uv = mi.Point2f(0.5, 0.5)
    sines = np.sqrt(1.0 - cosines**2)
    si.wi = mi.Vector3f(mi.Float(sines), 0.0, mi.Float(cosines))
    value = np.array(bsdf.eval(context, si, mi.Vector3f(0.0, 0.0, 1.0)), np.float64)[0]
    base = np.array(children(bsdf)["diffuse_reflectance"].eval(si), np.float64)
    base = np.broadcast_to(base.reshape(base.shape[0], -1), (base.shape[0], _COSINES))[0]
    both = np.divide(np.pi * value, base, out=np.zeros(_COSINES), where=base > 0.0)
    return np.asarray(both / np.sqrt(max(float(both[-1]), 1e-12)))
