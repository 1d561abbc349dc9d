"""Materials: a dielectric, a conductor or a perfect mirror; indices and reflectance (Dr.Jit).

Materials under a film, a coat or a stack (`layers`, `stack`) are materials, too.
"""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError
from ..optics.colour import RGB_WAVELENGTHS, metal_tint
from ..optics.fresnel import normal_reflectance, reflectance
from ..optics.materials import SODIUM, TISSUES
from .arithmetic import plain
from .conductors import spectrum_texture, tabulated_index
from .description import Feature
from .memory import upload
from .parameter_changes import Changeable
from .types import Colour, Float, Interaction, Mask, Number, Spectrum, Texture
from .varying import Varying

#: Bounds of ratios of refractive indices: beyond, squares leave single precision's range.
INDICES = (1e-3, 1e3)
#: Bounds of the parts of a conductor's index.
INDEX_PARTS = {"eta": INDICES, "k": (0.0, INDICES[1])}

Array = NDArray[Any]
#: Index of a material at wavelengths (n,), nm, as `Material.at`.
IndexAt = Callable[[Array], Any]
#: Wavelengths of a metal's spectrum that its colour is made of, nm.
_VISIBLE = np.arange(380.0, 780.0)
#: Wavelengths that a table of optical constants has to cover, nm. Daylight beyond is 0.3 % of what
#: eyes see; there the index is that of the nearest end of the table.
_REQUIRED = (400.0, 700.0)


class Material:
    """Material of a surface: an index in each channel, its reflectance, tint and absorption.

    Attributes
    ----------
    changeable : parameters that `traverse` exposes.
    kind : MIRROR, DIELECTRIC, RARER or CONDUCTOR.
    name : of a tabulated material, else empty.
    absorbs : whether light that is not reflected is absorbed, and none goes beneath.
    tint : columns of `optics.colour.metal_tint` in RGB variants, of a tabulated metal.
    layer : FILM or STACK, of layers over a material; else None.
    varying : `layers.Thickness` of a film by a texture, else None.
    reflects_all : whether there is total reflection: the medium above is the denser one.
    sums : `layers.Channels` of a film in RGB variants, else None.
    material : the material beneath layers, else None.
    """

    changeable: tuple[Changeable, ...] = ()
    kind = Feature.DIELECTRIC
    name = ""
    absorbs = False
    tint: list[Colour] | None = None
    layer: Feature | None = None
    varying: Any = None
    reflects_all = False
    sums: Any = None
    material: Material | None = None

    def indices(self, si: Interaction, active: Mask) -> list[Any]:
        """Return the index of each channel, relative to the medium above, or one for all."""
        raise NotImplementedError

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """Reflectance of the flat surface for unpolarised light.

        cos_theta : of the angle of incidence, or of that to the half vector.
        """
        return self.channels([reflectance(cos_theta, n) for n in self.indices(si, active)])

    def channels(self, values: list[Float]) -> Colour:
        """Return the channels' values from the values of `indices`."""
        return mi.UnpolarizedSpectrum(values if len(values) > 1 else values[0])

    def wavenumbers(self, wavenumbers: list[Float]) -> list[Float]:
        """Return wavenumbers of `indices`, rad/µm, from the channels' wavenumbers."""
        return wavenumbers

    def at(self, wavelengths: Array) -> Any:
        """Return n + ik at wavelengths (n,), nm, in the variant's colours; None for R = 1."""
        indices = []
        # one look-up of all wavelengths in a kernel, or one for each
        at_once = not mi.is_spectral or dr.is_jit_v(mi.Float)
        for light in [wavelengths] if at_once else wavelengths[:, None]:
            si = dr.zeros(mi.SurfaceInteraction3f, len(light) if mi.is_spectral else 1)
            if mi.is_spectral:
                values = upload(mi.Float, light.astype(np.float32)) if at_once else float(light[0])
                si.wavelengths = mi.UnpolarizedSpectrum(values)
            indices.append([_lanes(n) for n in self.indices(si, True)])
        if not mi.is_rgb:
            values = np.concatenate([channels[0] for channels in indices])
            return np.broadcast_to(values, wavelengths.shape)
        colours = np.broadcast_to(np.ravel(indices[0]), len(RGB_WAVELENGTHS))
        return np.interp(wavelengths, RGB_WAVELENGTHS[::-1], colours[::-1])

    def everywhere(self) -> list[IndexAt]:
        """Return `at`; or, of a film of varying thickness, one for each of even places."""
        return [self.at]

    def refusal(self) -> str | None:
        """Reason why parameters that are allowed each by itself are refused together, or None."""

    def derive(self) -> None:
        """Derive what depends on the parameters."""


class Perfect(Material):
    """R = 1 at every angle, `material="none"`."""

    kind = Feature.MIRROR

    def indices(self, si: Interaction, active: Mask) -> list[Any]:
        """Return no index."""
        return []

    def reflectance(self, cos_theta: Float, si: Interaction, active: Mask) -> Colour:
        """See `Material.reflectance`."""
        return mi.UnpolarizedSpectrum(1.0)

    def at(self, wavelengths: Array) -> None:
        """See `Material.at`."""

    def __str__(self) -> str:
        return "none"


class Dielectric(Material):
    """Interface between two dielectrics.

    Parameters
    ----------
    int_ior, ext_ior : indices, or names that Mitsuba knows.
    name, least : name and smallest value of the ratio as a parameter.
    advice : end of the message on a smaller one.

    Attributes
    ----------
    eta : the ratio.
    """

    def __init__(
        self,
        int_ior: float | str,
        ext_ior: float | str,
        name: str = "eta",
        least: float = INDICES[0],
        advice: str = "",
    ) -> None:
        eta, meaning = _ratio(int_ior, ext_ior), ", the ratio of refractive indices,"
        index = Varying(name, eta, least, INDICES[1], meaning=meaning, advice=advice)
        self.eta, self.changeable = index.value, (index,)
        self.derive()

    def indices(self, si: Interaction, active: Mask) -> list[Number]:
        """Return one index for all channels; complex where there is total reflection."""
        return [mi.Complex2f(self.eta, 0.0) if self.reflects_all else self.eta]

    def derive(self) -> None:
        """Determine whether there is total reflection, for which kernels differ."""
        self.reflects_all = plain(self.eta) < 1.0
        self.kind = Feature.RARER if self.reflects_all else Feature.DIELECTRIC

    def __str__(self) -> str:
        return f"dielectric[eta = {plain(self.eta):.5g}]"


class Inside(Material):
    """Dielectric seen from within: the medium above it, over the dielectric."""

    def __init__(self, outside: Dielectric, thin: bool) -> None:
        self._outside, self._thin = outside, thin

    def indices(self, si: Interaction, active: Mask) -> list[Number]:
        """Return one index for all channels; light from outside is never reflected totally."""
        index = dr.rcp(self._outside.eta)
        return [index if self._thin else mi.Complex2f(index, 0.0)]


class Conductor(Material):
    """Conductor, or a material with an index over wavelength: textures eta and k."""

    kind = Feature.CONDUCTOR

    def __init__(self, eta: Changeable, k: Changeable, name: str) -> None:
        self.eta: Texture = eta.value
        self.k: Texture = k.value
        self.name, self.changeable = name, (eta, k)
        self.absorbs = True
        self.medium: Dielectric | None = None  #: medium above, if not air
        #: Index of the medium above over that of `medium`, which is one number; None if it is 1.
        self.dispersion: Texture | None = None
        self.above = ""  #: name of the medium whose dispersion it is
        # of RGB's channels: the index over wavelengths, and as the channels have it
        self._spectrum: tuple[Array, Array] | None = None

    @classmethod
    def of_material(cls, material: str, wavelength: float) -> Conductor:
        """Return a tissue, or one of Mitsuba's tabulated conductors, by its name in the tables.

        wavelength : nm, where mono variants take the index; Mitsuba's is a mean over the spectrum.

        Raises a DiffractionError if the material is unknown, or its table is too short.
        """
        nodes, index = tabulated_index(material)
        first, last = nodes[0], nodes[-1]
        needed = (wavelength, wavelength) if mi.is_monochromatic else _REQUIRED
        if not first <= needed[0] <= needed[1] <= last:
            raise DiffractionError(
                f"material={material!r} is tabulated from {first:.4g} to {last:.4g} nm, and light "
                f"from {needed[0]:g} to {needed[1]:g} nm is needed; choose another material, or "
                "give spectra of eta and k"
            )
        parts = zip(INDEX_PARTS.items(), (index.real, index.imag), strict=True)
        eta, k = (
            Changeable(name, spectrum_texture(nodes, part, wavelength), bounds)
            for (name, bounds), part in parts
        )
        conductor = cls(eta, k, material)
        conductor.absorbs = material not in TISSUES or TISSUES[material].absorbs
        if mi.is_rgb:
            conductor._spectrum = np.interp(_VISIBLE, nodes, index), conductor._channels()
        return conductor

    def disperse(self, above: str, wavelength: float) -> None:
        """Give the medium above, a tissue by name, its index over wavelength.

        wavelength : nm, where mono variants take it.
        """
        nodes = TISSUES[above].nodes
        self.above = above
        self.dispersion = spectrum_texture(nodes, dispersion_of(above, nodes), wavelength)

    def indices(self, si: Interaction, active: Mask) -> list[Number]:
        """The complex index n + ik of each channel, relative to the medium above."""
        # Mitsuba's spectra are 0 beyond their data, which is no index: such light is reflected
        eta = dr.maximum(self.eta.eval(si, active), INDICES[0])
        k = self.k.eval(si, active)
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

    def derive(self) -> None:
        """Tint the colours of a tabulated metal; a changed index has no known spectrum."""
        self.tint = None
        if self._spectrum is None or not np.array_equal(self._channels(), self._spectrum[1]):
            return
        above = 1.0 if self.medium is None else plain(self.medium.eta)
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


def tinted(value: Spectrum, material: Material) -> Spectrum:
    """Correct a metal's colour in RGB variants to the colour of its spectrum."""
    if (tint := material.tint) is None:
        return value

    def of_channels(channels: Colour) -> Colour:
        red, green, blue = (column * one for column, one in zip(tint, channels, strict=True))
        return red + green + blue

    if not mi.is_polarized:
        return of_channels(value)
    return mi.Spectrum([[of_channels(value[i, j]) for j in range(4)] for i in range(4)])


def _lanes(number: Number) -> Array:
    """Return a number of each lane as an array (lanes,)."""
    parts = (number.real, number.imag) if dr.is_complex_v(number) else (number, mi.Float(0.0))
    real, imaginary = (np.array(dr.detach(part), np.float64).ravel() for part in parts)
    return np.asarray(real + 1j * imaginary)


def _ratio(int_ior: float | str, ext_ior: float | str) -> float:
    """Return a ratio of indices, or of media that Mitsuba knows by name."""
    try:
        probe = mi.load_dict({"type": "dielectric", "int_ior": int_ior, "ext_ior": ext_ior})
    except Exception as error:  # Mitsuba throws RuntimeError, over several lines
        reason = " ".join(str(error).split())
        if unknown := re.search(r'IOR value for "(.*)"! Valid choices are:(.*)', reason):
            name, media = unknown.groups()
            near = difflib.get_close_matches(name.lower(), {*TISSUES, *media.split(", ")}, 2)
            hint = f"did you mean {' or '.join(near)}? Or" if near else "choose"
            raise DiffractionError(
                f"int_ior={int_ior!r}, ext_ior={ext_ior!r}: medium {name!r} is unknown; {hint} one "
                f"of {media}; or give its index, e.g. 1.33"
            ) from error
        raise DiffractionError(
            f"int_ior={int_ior!r}, ext_ior={ext_ior!r} is not a material that Mitsuba knows "
            f"({reason[:200]}); give a number, a name from Mitsuba's table of materials, or eta "
            "and k"
        ) from error
    return float(dr.slice(mi.traverse(probe)["eta"]))
