"""Materials: a dielectric, a conductor or a perfect mirror; indices and reflectance (Dr.Jit)."""

from __future__ import annotations

from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from ..optics.colour import LONGEST, SHORTEST, metal_tint
from ..optics.fresnel import normal_reflectance
from ..optics.materials import SODIUM, TISSUES
from .conductors import (
    extended_texture,
    parameters_of,
    tabulated,
    tabulated_range,
    texture_at,
    unknown_conductor,
)
from .parameter_changes import Bounded, Changeable, ObjectValues, children
from .types import BSDF, Callback, Colour, Float, Interaction, Mask, Number, Spectrum, Texture

#: Bounds of ratios of refractive indices: beyond, squares leave single precision's range.
INDICES = (1e-3, 1e3)
#: Bounds of the parts of a conductor's index.
INDEX_PARTS = {"eta": INDICES, "k": (0.0, INDICES[1])}

Array = NDArray[Any]
#: Wavelengths of a metal's spectrum that its colour is made of, nm.
_VISIBLE = np.arange(380.0, 780.0)
#: Wavelengths that a table of optical constants has to cover, nm. Daylight beyond is 0.3 % of what
#: eyes see; there the index is that of the nearest end of the table.
_REQUIRED = (400.0, 700.0)


class Perfect:
    """R = 1 at every angle, `material="none"`."""

    changeable: tuple[Changeable, ...] = ()

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """R for the cosine (mi.Float) of the angle to the half vector, mi.UnpolarizedSpectrum."""
        return mi.UnpolarizedSpectrum(1.0)

    def traverse(self, callback: Callback) -> None:
        """Expose nothing."""

    def derive(self) -> None:
        """Derive nothing."""

    def __str__(self) -> str:
        return "none"


class Dielectric:
    """Fresnel reflectance of an interface between two dielectrics, unpolarised.

    Parameters
    ----------
    int_ior, ext_ior : indices, or names that Mitsuba knows.
    name, least : name and smallest value of the ratio as a parameter.

    Attributes
    ----------
    eta : the ratio.
    changeable : parameters that `traverse` exposes.
    reflects_all : whether there is total reflection: the medium above is the denser one.
    """

    def __init__(
        self,
        int_ior: float | str,
        ext_ior: float | str,
        name: str = "eta",
        least: float = INDICES[0],
    ) -> None:
        probe = _load("dielectric", int_ior=int_ior, ext_ior=ext_ior)
        eta = float(dr.slice(mi.traverse(probe)["eta"]))
        self._index = Bounded(name, eta, least, INDICES[1], partial(_ratio_refusal, name, least))
        self.eta = self._index.value
        self.changeable = (self._index,)
        self.traverse, self.refusal = self._index.traverse, self._index.refusal
        self.derive()

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """R for the cosine of the angle to the half vector, the same at every wavelength."""
        return mi.UnpolarizedSpectrum(mi.fresnel(cos_theta, self.eta)[0])

    def indices(self, si: Interaction, active: Mask) -> list[Number]:
        """The relative index, one for all channels; complex where there is total reflection."""
        return [mi.Complex2f(self.eta, 0.0) if self.reflects_all else self.eta]

    def derive(self) -> None:
        """Determine whether there is total reflection, for which kernels differ."""
        self.reflects_all = bool(dr.slice(dr.detach(self.eta)) < 1.0)

    def __str__(self) -> str:
        return f"dielectric[eta = {dr.slice(self.eta):.5g}]"


def _ratio_refusal(name: str, least: float, ratio: float) -> str:
    lowest = "above 0" if least == INDICES[0] else f"at least {least:g}"
    return (
        f"{name}={ratio:g}, the ratio of refractive indices, must be {lowest} and at most "
        f"{INDICES[1]:g}"
    )


class Inside:
    """Dielectric seen from within: the medium above it, over the dielectric."""

    reflects_all = True

    def __init__(self, outside: Dielectric, thin: bool) -> None:
        self._outside, self._thin = outside, thin

    def reflectance(self, cosine: Float, si: Interaction, active: Mask) -> Colour:
        """R for the cosine inside."""
        return mi.UnpolarizedSpectrum(mi.fresnel(cosine, dr.rcp(self._outside.eta))[0])

    def indices(self, si: Interaction, active: Mask) -> list[Number]:
        """The index, one for all channels; light from outside is never reflected totally."""
        index = dr.rcp(self._outside.eta)
        return [index if self._thin else mi.Complex2f(index, 0.0)]


class Conductor:
    """Fresnel reflectance of a conductor, eta and k as textures over wavelength."""

    def __init__(self, eta: ObjectValues, k: ObjectValues, name: str) -> None:
        self.eta: Texture = eta.thing
        self.k: Texture = k.thing
        self.name, self.changeable = name, (eta, k)
        #: Whether light that is not reflected is absorbed, and none goes beneath.
        self.absorbs = True
        self.medium: Dielectric | None = None  #: medium above, if not air
        #: Index of the medium above over that of `medium`, which is one number; None if it is 1.
        self.dispersion: Texture | None = None
        self.above = ""  #: name of the medium whose dispersion it is
        # of RGB's channels: the index over wavelengths, and as the channels have it
        self._spectrum: tuple[Array, Array] | None = None
        #: Columns of `optics.colour.metal_tint`, in RGB variants and of a tabulated material.
        self.tint: list[Colour] | None = None

    @classmethod
    def of_material(cls, material: str, wavelength: float) -> Conductor:
        """Return a tissue, or one of Mitsuba's tabulated conductors, by its name in the tables.

        wavelength : nm, where mono variants take the index; Mitsuba's is a mean over the spectrum.

        Raises a DiffractionError if the material is unknown, or its table is too short.
        """
        limits = tabulated_range(material)
        if limits is None:
            raise DiffractionError(unknown_conductor(material))
        first, last = limits
        objects = children(_load("conductor", **parameters_of(material)))
        needed = (wavelength, wavelength) if mi.is_monochromatic else _REQUIRED
        if not first <= needed[0] <= needed[1] <= last:
            raise DiffractionError(
                f"material={material!r} is tabulated from {first:.4g} to {last:.4g} nm, and light "
                f"from {needed[0]:g} to {needed[1]:g} nm is needed; choose another material, or "
                "give spectra of eta and k"
            )
        if mi.is_monochromatic:
            objects = {name: texture_at(material, name, wavelength) for name in INDEX_PARTS}
        elif mi.is_spectral and not first <= SHORTEST < LONGEST <= last:
            objects = {name: extended_texture(material, name) for name in INDEX_PARTS}
        eta, k = (ObjectValues(name, objects[name], INDEX_PARTS[name]) for name in INDEX_PARTS)
        conductor = cls(eta, k, material)
        conductor.absorbs = material not in TISSUES or TISSUES[material].absorbs
        if mi.is_rgb:
            index = tabulated(material, "eta", _VISIBLE) + 1j * tabulated(material, "k", _VISIBLE)
            conductor._spectrum = index, conductor._channels()
        return conductor

    def disperse(self, above: str, wavelength: float) -> None:
        """Give the medium above, a tissue by name, its index over wavelength.

        wavelength : nm, where mono variants take it.
        """
        nodes = TISSUES[above].nodes
        ratio = dispersion_of(above, nodes)
        spectrum: dict[str, Any] = {
            "type": "spectrum",
            "value": list(zip(nodes.tolist(), ratio.tolist(), strict=True)),
        }
        if mi.is_monochromatic:
            one = float(dispersion_of(above, np.array(wavelength)))
            spectrum = {"type": "uniform", "value": one}
        # a conductor's spectra are without bounds in every variant
        loaded = _load("conductor", eta=spectrum, k={"type": "uniform", "value": 0.0})
        self.above, self.dispersion = above, children(loaded)["eta"]

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """R for the cosine of the angle to the half vector, at si.wavelengths."""
        indices = self.indices(si, active)
        return mi.UnpolarizedSpectrum([mi.fresnel_conductor(cos_theta, n) for n in indices])

    def indices(self, si: Interaction, active: Mask) -> list[Number]:
        """The complex index n + ik of each channel, relative to the medium above."""
        eta, k = self.eta.eval(si, active), self.k.eval(si, active)
        if self.medium is not None:
            above = self.medium.eta
            if self.dispersion is not None:
                above = above * self.dispersion.eval(si, active)
            eta, k = eta / above, k / above
        return [mi.Complex2f(n, x) for n, x in zip(eta, k, strict=True)]

    def _dispersion_spectrum(self) -> tuple[Array, Array]:
        """Return `dispersion` at the wavelengths of the tint, and of RGB's channels."""
        if self.dispersion is None:
            return np.ones(1), np.ones(1)
        channels = self.dispersion.eval(dr.zeros(mi.SurfaceInteraction3f), True)
        return dispersion_of(self.above, _VISIBLE), np.array(channels).ravel()

    def _channels(self) -> Array:
        """n + ik of RGB's channels, without a medium."""
        si = dr.zeros(mi.SurfaceInteraction3f)
        eta, k = (
            np.array(dr.detach(texture.eval(si, True))).ravel() for texture in (self.eta, self.k)
        )
        return np.asarray(eta + 1j * k)

    def traverse(self, callback: Callback) -> None:
        """Expose both spectra."""
        callback.put("eta", self.eta, mi.ParamFlags.Differentiable)
        callback.put("k", self.k, mi.ParamFlags.Differentiable)

    def derive(self) -> None:
        """Tint the colours of a tabulated metal; a changed index has no known spectrum."""
        self.tint = None
        if self._spectrum is None or not np.array_equal(self._channels(), self._spectrum[1]):
            return
        above = 1.0 if self.medium is None else float(dr.slice(dr.detach(self.medium.eta)))
        spectrum, channels = (
            normal_reflectance(index / (above * ratio))
            for index, ratio in zip(self._spectrum, self._dispersion_spectrum(), strict=True)
        )
        self.tint = [mi.Color3f(rgb) for rgb in metal_tint(_VISIBLE, spectrum, channels).T.tolist()]
        dr.make_opaque(self.tint)

    def __str__(self) -> str:
        return f"{'conductor' if self.absorbs else 'dielectric'}[{self.name}]"


def dispersion_of(tissue: str, wavelengths: Array) -> Array:
    """Return a tissue's real index at wavelengths in nm over that at sodium's line."""
    index = TISSUES[tissue].index
    return np.asarray(index(wavelengths).real / index(SODIUM).real)


Reflectance = Perfect | Dielectric | Conductor


def tinted(value: Spectrum, material: object) -> Spectrum:
    """Correct a metal's colour in RGB variants to the colour of its spectrum."""
    tint: list[Colour] | None = getattr(material, "tint", None)
    if tint is None:
        return value

    def of_channels(channels: Colour) -> Colour:
        red, green, blue = (column * one for column, one in zip(tint, channels, strict=True))
        return red + green + blue

    if not mi.is_polarized:
        return of_channels(value)
    return mi.Spectrum([[of_channels(value[i, j]) for j in range(4)] for i in range(4)])


def _load(plugin: str, **parameters: Any) -> BSDF:
    """Load one of Mitsuba's own BSDFs, which know the names of materials."""
    try:
        return mi.load_dict({"type": plugin, **parameters})
    except Exception as error:  # Mitsuba throws RuntimeError, over several lines
        arguments = ", ".join(f"{name}={value!r}" for name, value in parameters.items())
        reason = " ".join(str(error).split())
        if plugin == "conductor":
            raise DiffractionError(unknown_conductor(str(parameters.get("material")))) from error
        raise DiffractionError(
            f"{arguments} is not a material that Mitsuba knows ({reason[:200]}); give a number, a "
            "name from Mitsuba's table of materials, or eta and k"
        ) from error
