"""A surface that diffracts: the part that the plugins share, whichever way the light leaves."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi

from .boundary import Boundary
from .conductors import tabulated_range
from .description import Feature, Film, Material, Quantity, Surface
from .directions import Pair, PatchFrame, Site
from .energy import indices_of
from .energy_factors import ScaleRange
from .factors import LEAST_SCALE, VaryingFactor
from .fresnel import Conductor, Perfect, Reflectance, tinted
from .layers import CoatedPair, UnderCoat, UnderFilm
from .nesting import NestingBSDF
from .parameter_changes import Bounded, Changeable
from .power import power_model
from .stack import UnderStack
from .surface_parameters import SurfaceParameters
from .types import BSDF, Colour, Context, Float, Interaction, Mask, Properties, Spectrum


class DiffractingSurface(NestingBSDF):
    """Table, factors, orientation and power of a surface; the lobe that they make.

    Attributes
    ----------
    table : the diffraction table.
    heights : function that reads the heights that the table is made of.
    window_positions : positions of windows, or None where the table averages over them.
    fresnel : reflectance of the flat surface, with its layers.
    orientation : angle from the first tangent to the patch's x axis.
    lateral_scale : factor on lengths in the patch's plane.
    height_scale : mi.Float; the largest, where it varies.
    power : `power.PowerModel` of the variant.
    wavelength : nm, of mono variants.
    """

    def __init__(
        self,
        props: Properties,
        surface: SurfaceParameters,
        fresnel: Reflectance | UnderCoat | UnderFilm | UnderStack,
        nested: BSDF = None,
    ) -> None:
        super().__init__(props, nested)
        self.table, self.heights = surface.table, surface.heights
        self.window_positions, self.wavelength = surface.window_positions, surface.wavelength
        self.fresnel, self.orientation = fresnel, surface.orientation
        self.lateral_scale = surface.lateral_scale
        self.power = power_model(self.table, self.wavelength, self.window_positions)
        # Heights are in a medium of this optical index
        self._set_height_scale(surface.height_scale, surface.optical)
        self.parameters += [
            *self._scale_changeable,
            *self.orientation.changeable,
            *self.lateral_scale.changeable,
            *fresnel.changeable,
        ]
        # 4π²σ⁴/A of eq. 3 and 4, with the window's area A = πσ²
        self.area_factor = 4.0 * dr.pi * self.table.sigma**2

    def _set_height_scale(self, factor: float | VaryingFactor, optical: float) -> None:
        """Keep a bounded number; or factors that vary, of which `height_scale` is the largest."""
        if isinstance(factor, VaryingFactor):
            self._scale: VaryingFactor | Bounded = factor
            self._varying: VaryingFactor | None = factor
            self._scale_changeable: tuple[Changeable, ...] = factor.changeable
            self.height_scale: Float = mi.Float(factor.high)
            return
        most = self.table.height_scale_max / optical
        bounded = Bounded("height_scale", factor, LEAST_SCALE, most, partial(_scale_refusal, most))
        self._scale, self._varying, self.height_scale = bounded, None, bounded.value
        self._scale_changeable = (bounded,)

    @property
    def sigma(self) -> float:
        """Standard deviation of the amplitude window, µm."""
        return self.table.sigma

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
        power: Colour,
        active: Mask,
    ) -> Spectrum:
        """Return f cosθo of a boundary.

        power : `geometry` times ⟨|P|²⟩ / (4π²σ⁴ λ²), per channel.
        """
        factor = boundary.factor(pair, site.scale, site.wavenumbers, site.si, active, ctx.mode)
        return dr.select(active, tinted(mi.Spectrum(power) * factor, boundary.material), 0.0)

    def face(
        self, ctx: Context, site: Site, pair: Pair, mirror: Boundary, active: Mask
    ) -> Spectrum:
        """Return f cosθo of a flat face: the lobe of a flat patch."""
        power = self.geometry(pair) * self.power.flat(pair, site.si)
        return self.lobe(ctx, replace(site, scale=mi.Float(0.0)), pair, mirror, power, active)

    def normal_reflectance(self, site: Site, active: Mask) -> Spectrum:
        """See `NestingBSDF.normal_reflectance`."""
        return mi.Spectrum(self.fresnel.reflectance(mi.Float(1.0), site.si, active))

    def site_at(self, si: Interaction, active: Mask) -> Site:
        """See `NestingBSDF.site_at`."""
        scale = self._varying.at(si, active) if self._varying else self.height_scale
        return Site(si, self.frame_at(si, active), scale, self.power.wavenumbers(si))

    def frame_at(self, si: Interaction, active: Mask) -> PatchFrame:
        """Return the patch as it lies at points of the surface."""
        return PatchFrame(
            self.orientation.rotation(si, active), self.lateral_scale.over_table(si, active)
        )

    # ------------------------------------------------------------------ changes of parameters

    def refusals(self) -> Iterator[str | None]:
        """See `Changing.refusals`."""
        if self._varying is not None:
            yield self._varying.refusal()

    def optical_refusal(self, index: Float, name: str, parameter: str) -> str | None:
        """Reason why heights times the index that they are in are beyond the table, or None.

        name, parameter : of the index, as it changes and as it is loaded.
        """
        optical = float(dr.slice(dr.max(dr.detach(self.height_scale * index))))
        if optical <= self.table.height_scale_max * (1.0 + 1e-6):
            return None
        return (
            f"height_scale times {name} is {optical:g}, beyond the table's "
            f"{self.table.height_scale_max:g}; load the plugin anew with that {parameter}"
        )

    def scale_range(self) -> ScaleRange:
        """Return the factors that energy is to be conserved for."""
        largest = dr.slice(dr.max(dr.detach(self.height_scale)))
        lowest = self._varying.range()[0] if self._varying else largest
        stretch = self.lateral_scale.range_over_table()
        differentiable = dr.grad_enabled(self.height_scale) or self.lateral_scale.differentiable
        varies = bool(self._varying or self.lateral_scale.varying)
        return ScaleRange((lowest, largest), stretch, varies, differentiable)

    def freeze(self, holders: Iterable[Any], *constants: object) -> None:
        """See `PluginBSDF.freeze`; adds the fields of all surfaces."""
        factors = self._varying, self.lateral_scale
        textures = str(self._varying), str(self.lateral_scale.varying)
        placed = str(self.window_positions)
        super().freeze(
            (self.power, self.orientation, self.fresnel, *factors, *holders),
            self.table.digest(), placed, *textures, *constants,
        )  # fmt: skip

    # ------------------------------------------------------------------ for people and shaders

    def describe(self) -> Surface:
        """Return the description of the surface (`description.describe`)."""
        structure: Any = self.boundary.material
        film = None
        if isinstance(structure, UnderFilm):
            film, structure = Film(*structure.numbers()), structure.material
        stacked = isinstance(structure, UnderStack)
        if stacked:
            structure = structure.material
        largest = float(dr.slice(dr.max(dr.detach(self.height_scale))))
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
            height_scale=Quantity(largest, self._varying and self._varying.texture),
            lateral_scale=self.lateral_scale.quantity,
            largest_scale=float(self.table.height_scale_max),
            material=_described(structure),
            film=film,
            model=str(self.boundary),
            stacked=stacked,
        )

    @property
    def model(self) -> str:
        """Name of the boundary model, for people."""
        return str(self.boundary)

    @property
    def energy_conserving(self) -> bool:
        """Whether the BSDF is scaled so that it never reflects more than it receives."""
        return self._energy is not None

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
            "model": self.model,
            "height_scale": self._varying or f"{dr.slice(self.height_scale):g}",
            "energy_conserving": "true" if self.energy_conserving else "false",
            "orientation": self.orientation,
            "lateral_scale": self.lateral_scale,
        }


def _described(material: Any) -> Material:
    """Return the record of a structure's material."""
    if isinstance(material, Perfect):
        return Material(Feature.MIRROR)
    index: Any = partial(indices_of, material)
    if isinstance(material, Conductor):
        return Material(Feature.CONDUCTOR, index, tabulated_range(material.name), material.name)
    return Material(Feature.RARER if material.reflects_all else Feature.DIELECTRIC, index)


def _scale_refusal(most: float, height_scale: float) -> str:
    return (
        f"height_scale={height_scale:g} is outside the table's range, above 0 and up to "
        f"{most:g}; load the plugin anew with that height_scale"
    )
