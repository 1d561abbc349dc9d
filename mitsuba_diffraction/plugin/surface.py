"""Surface with a table of heights, shared by the two plugins of heights (Dr.Jit)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ..errors import DiffractionError
from ..optics.boundary import model_of
from ..tables.build.derivatives import missing
from . import parameters as read
from .arithmetic import plain
from .base import SurfaceBSDF
from .boundary import Boundary, order_0
from .conductors import is_tabulated
from .description import Feature, Surface
from .directions import CoatedPair, Pair, PatchFrame, Site
from .energy import EnergyModel
from .energy_factors import ScaleRange
from .height_derivatives import MOST_DIFFERENTIABLE, DifferentiableHeights
from .layers import warn_of_film
from .loops import only_in
from .materials import Material, tinted
from .power import PowerModel, power_model
from .properties import flag
from .sources import read_patch
from .types import (
    BSDF,
    Colour,
    Context,
    Float,
    Interaction,
    Mask,
    Number,
    Powers,
    Properties,
    Spectrum,
)
from .varying import LEAST_SCALE, MOST_SCALE, LateralScale, Varying, largest_of
from .window_positions import window_positions


class DiffractingSurface(SurfaceBSDF):
    """Table, factors, orientation and material of a surface; the lobe that they make.

    Parameters
    ----------
    material : of the structure, without film and stack, which are read here.
    optical : index of the medium that heights are in, relative to the medium above.

    Attributes
    ----------
    table : the diffraction table.
    heights : function that reads the heights that the table is made of; given : the parameter
        `data`, or None.
    window_positions : positions of windows, or None where the table averages over them.
    orientation, lateral_scale, height_scale : the patch as it lies on the surface.
    boundary : model of the structure's material; fresnel : flat surface with all layers.
    power : `power.PowerModel` of the variant.
    energy : scale by which energy is conserved, made after all layers are known.
    wavelength : nm, of mono variants.
    """

    energy: EnergyModel
    fresnel: Material

    def __init__(
        self,
        props: Properties,
        nested: BSDF | None,
        material: Material,
        optical: float,
    ) -> None:
        super().__init__(props, nested)
        model = read.model_of(props, material)
        read.check_combination(props, material, nested)
        scale, largest = largest_of(props, "height_scale", LEAST_SCALE, MOST_SCALE)
        varies = isinstance(scale, mi.Texture)
        if "height_scale_max" in props and not varies:
            raise DiffractionError("height_scale_max is for a height_scale that is a texture")
        self.lateral_scale = LateralScale(props)
        # κ grows by the index, as if heights did
        stretch = self.lateral_scale.of_table
        patch = read_patch(props, largest * optical, stretch)
        self.table, self.heights, self.given = patch
        most = largest if varies else self.table.height_scale_max / optical
        advice = ", the table's range; load the plugin anew with that height_scale"
        self.height_scale = Varying("height_scale", scale, 0.0, most, positive=True, advice=advice)
        self.orientation = read.orientation_of(props)
        self.wavelength = read.mono_wavelength(props, self.table.wavelength_range)
        self.energy_conserving = flag(props, "energy_conserving", True)
        self.window_positions = window_positions(props, self.table)
        self.power = self._power()
        material = read.layered(props, material, self.table)
        warn_of_film(material, self.table, largest)
        self.boundary = Boundary(model_of(model), material).on(self.table.roughness)
        self.fresnel = material
        # 4π²σ⁴/A of eq. 3 and 4, with the window's area A = πσ²
        self.area_factor = 4.0 * dr.pi * self.table.sigma**2

    def ready(self) -> None:
        """See `PluginBSDF.ready`."""
        if self.given is not None:
            self.given.missing = self._missing()
            self.parameters.append(self.given)
        lateral = [self.lateral_scale] if self.lateral_scale.given else []
        self.parameters += [self.height_scale, self.orientation, *lateral, *self.fresnel.changeable]
        super().ready()

    # ------------------------------------------------------------------ the model

    def geometry(self, pair: Pair) -> Float:
        """Return 4π²σ⁴ / (A w² cosθi), the part of eq. 4 that is neither power nor N'."""
        w = pair.cos_i + pair.cos_o
        factor = self.area_factor * pair.frame.area * dr.rcp(dr.square(w) * pair.cos_i)
        if isinstance(pair, CoatedPair):  # directions are those within the coat
            factor *= pair.outer.cos_o * dr.rcp(pair.cos_o)
        return factor

    def lobe(
        self,
        ctx: Context,
        site: Site,
        pair: Pair,
        boundary: Boundary,
        power: Powers,
        active: Mask,
        shadowing: Float = 1.0,
    ) -> Spectrum:
        """Return f cosθo of a boundary, eq. 4 to 10.

        shadowing : of all orders but 0.
        """
        indices = boundary.material.indices(site.si, active)
        factor = boundary.factor(pair, site.scale, site.wavenumbers, indices, ctx.mode)
        level = mi.Spectrum(power.others * (self.geometry(pair) * shadowing))
        others = dr.select(active, tinted(level * factor, boundary.material), 0.0)
        mirror = self.mirrored(ctx, site, pair, boundary.material, indices, power.zeroth, active)
        return interfering(others, mirror, power.cosine)

    def material_factor(self, pair: Pair, site: Site) -> tuple[Spectrum, Float]:
        """Return the power of diffracted orders over a perfect reflector's, and w.

        A lobe's f of eq. 4, without its power ⟨|P|²⟩, over that of R = 1 in the same directions;
        w, with which κ = k w of the power: within a coat it is larger.
        """
        indices = self.boundary.material.indices(site.si, True)
        args = site.scale, site.wavenumbers, indices, mi.TransportMode.Radiance
        perfect = dr.square(pair.outer.one_plus_dot) * self.geometry(pair.outer)
        level = mi.Spectrum(self.geometry(pair) * dr.rcp(perfect))
        factor = self.boundary.factor(pair, *args)
        return tinted(level * factor, self.boundary.material), pair.w

    def mirrored(
        self,
        ctx: Context,
        site: Site,
        pair: Pair,
        material: Material,
        indices: list[Number],
        zeroth: Colour,
        active: Mask,
    ) -> Spectrum:
        """Return f cosθo of order 0, eq. 10.

        indices : of the material (`Material.indices`).
        zeroth : ⟨|P_0|²⟩ / (4π²σ⁴ λ²), per channel.
        """
        width = self.table.sigma_0 * pair.frame.stretch
        level = zeroth * (self.area_factor * pair.frame.area * pair.outer.cos_o)

        def reflected() -> Spectrum:
            factor = order_0(material, pair, site.wavenumbers, width, indices, ctx.mode)
            return tinted(mi.Spectrum(level) * factor, material)

        return only_in(active & dr.any(level != 0.0), reflected)  # the lobe is narrow

    def face(
        self, ctx: Context, site: Site, pair: Pair, material: Material, active: Mask
    ) -> Spectrum:
        """Return f cosθo of a flat face."""
        indices, flat = material.indices(site.si, active), self.power.flat(pair, site.si)
        return self.mirrored(ctx, site, pair, material, indices, flat, active)

    def reflected_share(self, site: Site, active: Mask) -> Colour:
        """See `SurfaceBSDF.reflected_share`."""
        return self.fresnel.reflectance(mi.Frame3f.cos_theta(site.si.wi), site.si, active)

    def site_at(self, si: Interaction, active: Mask) -> Site:
        """See `SurfaceBSDF.site_at`."""
        scale = self.height_scale.at(si, active)
        known = self.power.bounded(si)
        return Site(known, self.frame_at(si, active), scale, self.power.wavenumbers(known))

    def frame_at(self, si: Interaction, active: Mask) -> PatchFrame:
        """Return the patch as it lies at points of the surface."""
        return PatchFrame(
            self.orientation.rotation(si, active), self.lateral_scale.over_table(si, active)
        )

    # ------------------------------------------------------------------ changes of parameters

    def refusals(self) -> Iterator[str | None]:
        """See `PluginBSDF.refusals`."""
        yield self.fresnel.refusal()

    def optical_refusal(self, index: Float, name: str, parameter: str) -> str | None:
        """Reason why heights times the index that they are in are beyond the table, or None.

        name, parameter : of the index, as it changes and as it is loaded.
        """
        optical = self.height_scale.number * plain(index)
        if optical <= self.table.height_scale_max * (1.0 + 1e-6):
            return None
        return (
            f"height_scale times {name} is {optical:g}, beyond the table's "
            f"{self.table.height_scale_max:g}; load the plugin anew with that {parameter}"
        )

    def derive(self) -> None:
        """Compute what depends on the parameters: a table, indices and scales of energy."""
        if self.given is not None and (patch := self.given.made()) is not None:
            self.table, self.heights = patch.table, patch.heights
            self.power = self._power()
            self.boundary = self.boundary.on(self.table.roughness)
        self.fresnel.derive()
        mean = self.table if self.window_positions is None else self.table.averaged
        self.energy.update(mean, self.scale_range())

    def _power(self) -> PowerModel:
        heights = None
        if self.given is not None and self.given.differentiable:
            heights = DifferentiableHeights(self.given.value, self.heights().heights)
        return power_model(self.table, self.wavelength, self.window_positions, heights)

    def _missing(self) -> list[str]:
        """Return what the surface lacks to have derivatives by its heights."""
        assert self.given is not None
        heights, given = self.heights().heights, np.array(self.given.value)
        rounding = 1e-5 * np.ptp(given) + np.spacing(np.abs(given).max())  # of single precision
        treated = heights.shape != given.shape or np.ptp(heights - given) > rounding
        lacks = {
            "a spectral or mono variant": mi.is_rgb,
            "model=kirchhoff": self.boundary.model.name != "kirchhoff",
            "energy_conserving=false": self.energy_conserving,
            "no BSDF beneath": self.nested is not None,
            "heights that no crop, level or clip changes": treated,
            "a wider window or a smaller patch": self.table.grid.taps_read > MOST_DIFFERENTIABLE,
        }
        return missing(self.table) + [name for name, is_so in lacks.items() if is_so]

    def scale_range(self) -> ScaleRange:
        """Return the factors that energy is to be conserved for."""
        height, lateral = self.height_scale, self.lateral_scale
        heights = height.range()[0], height.number
        varies = bool(height.texture or lateral.texture)
        differentiable = height.differentiable or lateral.differentiable
        return ScaleRange(heights, lateral.range_over_table(), varies, differentiable)

    def kernel_constants(self) -> tuple[object, ...]:
        """See `PluginBSDF.kernel_constants`."""
        textures = str(self.height_scale.texture), str(self.lateral_scale.texture)
        return self.table.digest(), str(self.window_positions), *textures, str(self.boundary)

    # ------------------------------------------------------------------ for people and shaders

    def describe(self) -> Surface:
        """Return the description of the surface (`description.describe`)."""
        structure = self.boundary.material
        material = structure.material or structure
        placed = self.window_positions is not None
        return Surface(
            table=self.table,
            text=str(self.fresnel),
            coherence_width=float(self.table.coherence_width),
            orientation=self.orientation.quantity,
            frame=lambda si: (
                *self.orientation.rotation(si, mi.Mask(True)),
                self.lateral_scale.over_table(si, mi.Mask(True)),
            ),
            coherence="surface" if placed else self.table.coherence,
            heights=self.heights,
            height_scale=self.height_scale.quantity,
            lateral_scale=self.lateral_scale.quantity,
            kind=material.kind,
            index=None if material.kind is Feature.MIRROR else material.at,
            material=material.name if is_tabulated(material.name) else "",
            layer=structure.layer,
            film_varies=structure.varying is not None,
            model=str(self.boundary),
            transmits=self.transmits,
        )

    def shown(self) -> dict[str, Any]:
        """See `PluginBSDF.shown`."""
        placed = {}
        if self.window_positions is not None:
            placed["coherence"] = f"surface, {self.window_positions}"  # see textures.PLACED
        return {
            "table": self.table,
            "wavelengths": "{:g} to {:g} nm".format(*self.table.wavelength_range),
            "coherence_width": self.table.width_text,
            **placed,
            "tolerance": f"{self.table.tolerance:g}",
            "surface": self.fresnel,
            "model": str(self.boundary),
            "height_scale": self.height_scale,
            "energy_conserving": "true" if self.energy_conserving else "false",
            "orientation": self.orientation,
            "lateral_scale": self.lateral_scale,
        }


#: Least f of orders that interfere: its square is a number of single precision, too.
_DARK = 1e-18


def interfering(others: Spectrum, mirror: Spectrum, cosine: Colour | None) -> Spectrum:
    """Return the sum of f of all orders but 0 and of order 0.

    Under one window Mueller matrices add up as powers do, and have the interference of unpolarised
    light.

    cosine : of the phase between both, per channel; None in an ensemble.
    """
    total = others + mirror
    if cosine is None:
        return total
    # above 0, where roots have derivatives
    a, b = (dr.maximum(mi.unpolarized_spectrum(f), _DARK) for f in (others, mirror))
    beats = 2.0 * cosine * dr.sqrt(a) * dr.sqrt(b) * dr.rcp(a + b)
    return total * mi.Spectrum(dr.maximum(1.0 + beats, 0.0))
