"""The Mitsuba BSDF plugin `diffraction_orders`: gratings whose orders were solved.

For steep grooves, most of all of metal, where the models of `diffraction` are far off: a CD, a
blazed grating, an embossed hologram. `mitsuba-diffraction solve` makes the table (docs/orders.md).

table : string
    File of `mitsuba-diffraction solve`, or of a table saved in Python.
data : OrderTable
    Instead: a table, in dictionaries only, by `md.bsdf_dict`.
coherence_width : float or string [auto]
    4σ of the Gaussian amplitude window, µm, which is the width over which light is coherent, at
    least 2 periods. `auto` is 65 (sunlight). It sets the width of the orders' lobes.
orientation : float or texture ∂ [0]
    Angle in degrees from the first tangent to the direction in which the profile repeats, as of
    `diffraction`.
wavelength : float [550]
    Wavelength of mono variants, nm.

The profile's clear layer, the table's superstrate, is a coat with a flat face: the face is a mirror
of the same coherence width, and light that it sends back to the grating is summed as of powers.

    f = Σ_m η_m(ωi, λ) (k²σ²/π) exp(−σ²|q − q_m|²),   q = k (u, v),   q_m = (2πm/d, 0)

RGB variants sum this over daylight. Polarised variants depolarise the light, of which they warn.
Wavelengths outside the table have the efficiencies of the nearest that it has.

    <bsdf type="diffraction_orders">
        <string name="table" value="grating.nc"/>
    </bsdf>
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi

from ...errors import warn
from ...optics.geometry import sigma_of
from ..directions import Pair, PatchFrame
from ..parameter_changes import arrays_within, check_parameters, marks, take_changes
from ..sampling import direction_of
from ..types import (
    Callback,
    Context,
    Float,
    Interaction,
    Mask,
    Properties,
    Sample,
    Spectrum,
    Vector2f,
    Vector3f,
)
from .lobes import lobes_of
from .parameters import read_parameters


class DiffractionOrders(mi.BSDF):
    """Reflection by a grating with solved orders.

    Attributes
    ----------
    table : efficiencies of the orders.
    orientation : angle from the first tangent to the patch's x axis.
    parameters : everything that `traverse` exposes.
    mix : the mix that the surface is part of, as a weak reference, or None.
    """

    #: Feature that shaders do not support.
    not_in_shaders = "solved orders"

    def __init__(self, props: Properties) -> None:
        super().__init__(props)
        read = read_parameters(props)
        self.table, self.orientation = read.table, read.orientation
        self.coherence_width, self._wavelength = read.coherence_width, read.wavelength
        self._lobes = lobes_of(self.table, self.coherence_width, self._wavelength)
        self.parameters = [*self.orientation.changeable]
        self.mix: weakref.ref[Any] | None = None
        glossy = mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.Anisotropic | mi.BSDFFlags.FrontSide
        self.m_components = [glossy]
        self.m_flags = glossy
        if mi.is_polarized:
            _warn_of_polarisation()
        check_parameters([self])
        self.derive()

    @property
    def sigma(self) -> float:
        """Standard deviation of the amplitude window, µm."""
        return sigma_of(self.coherence_width)

    # ------------------------------------------------------------------ Mitsuba's interface

    def eval(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Spectrum:
        """Return f cosθo per wavelength."""
        return self.eval_pdf(ctx, si, wo, active)[0]

    def pdf(self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True) -> Float:
        """Return the density of `sample` per solid angle."""
        return self.eval_pdf(ctx, si, wo, active)[1]

    def eval_pdf(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask = True
    ) -> tuple[Spectrum, Float]:
        """Return `eval` and `pdf` at once."""
        cos_i, cos_o = mi.Frame3f.cos_theta(si.wi), mi.Frame3f.cos_theta(wo)
        active = mi.Mask(active) & (cos_i > 0.0) & (cos_o > 0.0)
        if not ctx.is_enabled(mi.BSDFFlags.GlossyReflection, 0):
            return mi.Spectrum(0.0), mi.Float(0.0)
        pair = Pair(si, wo, self._frame(si, active), active)
        light = self._lobes.reflected(pair, si)
        value = mi.depolarizer(mi.UnpolarizedSpectrum(light.value))
        return dr.select(active, mi.Spectrum(value), 0.0), dr.select(active, light.density, 0.0)

    def sample(
        self,
        ctx: Context,
        si: Interaction,
        sample1: Float,
        sample2: Vector2f,
        active: Mask = True,
    ) -> tuple[Sample, Spectrum]:
        """Draw an order by its efficiency, and a direction in its lobe."""
        cos_i = mi.Frame3f.cos_theta(si.wi)
        active = mi.Mask(active) & (cos_i > 0.0)
        frame = self._frame(si, active)
        incident = dr.detach(frame.turned(si.wi))
        drawn = self._lobes.draw(incident, cos_i, si, sample1, sample2)
        result = dr.zeros(mi.BSDFSample3f)
        result.eta = 1.0
        result.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
        tangential = frame.from_table(drawn.uv) - mi.Vector2f(si.wi.x, si.wi.y)
        result.wo = dr.detach(direction_of(tangential))
        value, density = self.eval_pdf(ctx, si, result.wo, active & drawn.valid)
        active &= density > 0.0
        result.pdf = dr.select(active, density, 0.0)
        weight = value * dr.rcp(dr.select(active, density, 1.0))
        return result, dr.select(active, weight, 0.0)

    def eval_diffuse_reflectance(self, si: Interaction, active: Mask = True) -> Spectrum:
        """Return the albedo at normal incidence, for denoisers."""
        albedo = self._lobes.albedo(mi.Vector2f(0.0), mi.Float(1.0), si)
        return dr.select(active, dr.clip(mi.Spectrum(albedo), 0.0, 1.0), 0.0)

    def _frame(self, si: Interaction, active: Mask) -> PatchFrame:
        """Return the axes of the profile at points of the surface."""
        return PatchFrame(self.orientation.rotation(si, active))

    # ------------------------------------------------------------------ changes of parameters

    def traverse(self, callback: Callback) -> None:
        """Expose the orientation."""
        self.orientation.traverse(callback)

    def parameters_changed(self, keys: list[str]) -> None:
        """Take all changes, or none of them.

        Raises
        ------
        DiffractionError
            If a parameter is out of bounds. All parameters then have their last values.
        """
        mix = self.mix and self.mix()
        take_changes(self, mix.together if mix else [self])

    def refusals(self) -> Iterator[str | None]:
        """See `Changing.refusals`."""
        yield None

    def derive(self) -> None:
        """Collect what `dr.freeze` must know."""
        held = arrays_within(self._lobes, self.orientation)
        self._for_freezing = held + marks(self.table, self.coherence_width)

    def to_string(self) -> str:
        """Describe all parameters, for people."""
        shown = {
            "table": self.table,
            "coherence_width": f"{self.coherence_width:g} µm",
            "orientation": self.orientation,
        }
        lines = "".join(f"  {name} = {value},\n" for name, value in shown.items())
        return f"DiffractionOrders[\n{lines}]"


_warned: list[bool] = []


def _warn_of_polarisation() -> None:
    """Warn once a process."""
    if not _warned:
        _warned.append(True)
        warn(
            "diffraction_orders has efficiencies of unpolarised light: in this polarised variant "
            "it depolarises the light that it reflects"
        )


mi.register_bsdf("diffraction_orders", DiffractionOrders)
