"""The Mitsuba BSDF plugin `diffraction_orders`: gratings whose orders were solved.

For steep grooves, most of all of metal, where the models of `diffraction` are far off: a CD, a
blazed grating, an embossed hologram. `mitsuba-diffraction solve` makes the table
([orders.md](orders.md)). The profile repeats along x.

The grating
-----------
table : string
    File of `mitsuba-diffraction solve`, or of `OrderTable.save`.
data : OrderTable
    Instead: a table, in dictionaries only, by `md.bsdf_dict`.
coherence_width : float or string [auto]
    4σ of the Gaussian amplitude window, µm, over which light is coherent, at least 2 periods. It
    sets the width of the orders' lobes. `auto` is 65 (sunlight).
orientation : float or texture ∂ [0]
    Angle in degrees from the first tangent to the direction in which the profile repeats, as of
    `diffraction`.
wavelength : float [550]
    Wavelength of mono variants, nm.
(nested) : BSDF ∂
    BSDF beneath, which receives the light that is in no order, by T(ωi) T(ωo) with T = 1 − Σ η_m:
    for a dielectric grating over pigment, for example. A metal absorbs that light: nest nothing.

The model is a sum of lobes, one for each order m, of the efficiency η_m of the table:

    f = Σ_m η_m(ωi, λ) (k²σ²/π) exp(−σ²|q − q_m|²),   q = k (u, v),   q_m = (2πm/d, 0)

The table's clear layer (superstrate) is a coat with a flat face: a mirror of the same coherence
width. Light that the face sends back to the grating is summed over all orders and reflections, in
powers. RGB variants sum f over daylight. Polarised variants have the Mueller matrices of a table of
`solve --polarised`; with another table they depolarise the light, and warn once. Wavelengths
outside the table by less than a tenth of an octave have the efficiencies of the nearest in it;
other light is not reflected, which is warned of where it is visible. f is reciprocal as far as the
table is, at the centres of lobes.

A table of a thin sheet (`solve --thin`) makes the BSDF a sheet, with the grating on the side that
normals point to. It reflects and transmits light from either side, and nests no BSDF. Component 0
is the reflection, component 1 the transmission. It depolarises light.

XML and the same in Python:

    <bsdf type="diffraction_orders">
        <string name="table" value="grating.nc"/>
        <float name="orientation" value="90"/>
    </bsdf>

    import mitsuba_diffraction as md  # before Mitsuba: registers the plugin
    import mitsuba as mi

    mi.set_variant("llvm_ad_spectral")
    md.OrderTable.mirror(period=1.6, reflectance=0.9).save("grating.nc")
    bsdf = mi.load_dict({"type": "diffraction_orders", "table": "grating.nc", "orientation": 90})
"""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from typing import Any

import drjit as dr
import mitsuba as mi

from ...errors import warn
from ...optics.geometry import sigma_of
from ...tables.orders import OrderTable
from .. import nesting
from ..description import Nested, Surface
from ..directions import Pair, PatchFrame
from ..parameter_changes import (
    Changeable,
    ObjectValues,
    arrays_within,
    check_parameters,
    marks,
    take_changes,
)
from ..sampling import direction_of
from ..types import (
    BSDF,
    Callback,
    Colour,
    Context,
    Float,
    Interaction,
    Mask,
    Properties,
    Spectrum,
    Vector2f,
    Vector3f,
)
from .grating_parameters import Parameters
from .lobes import DaylightLobes, Lobes, SpectralLobes
from .polarised_lobes import PolarisedLobes


class DiffractionOrders(mi.BSDF):
    """Reflection by a grating with solved orders.

    Attributes
    ----------
    table : efficiencies of the orders.
    orientation : angle from the first tangent to the patch's x axis.
    parameters : everything that `traverse` exposes.
    mix : the mix that the surface is part of, as a weak reference, or None.
    """

    def __init__(self, props: Properties, read: Parameters) -> None:
        super().__init__(props)
        self.table, self.orientation = read.table, read.orientation
        self.coherence_width, self._wavelength = read.coherence_width, read.wavelength
        self._lobes = _lobes_of(read)
        self.nested: BSDF = read.nested  # or None
        self.parameters: list[Changeable] = [*self.orientation.changeable]
        if self.nested is not None:
            self.parameters.append(ObjectValues("nested", self.nested))
        self.mix: weakref.ref[Any] | None = None
        components = nesting.components_of(self.nested)
        self.m_components = components  # at once: reading it makes a copy
        self.m_flags = nesting.flags_of(components)
        if mi.is_polarized and not self.table.polarised:
            _warn_of_polarisation()
        _warn_of_wavelengths(self.table)
        check_parameters([self])
        self.derive()

    @property
    def sigma(self) -> float:
        """Standard deviation of the amplitude window, µm."""
        return sigma_of(self.coherence_width)

    # ------------------------------------------------------------------ Mitsuba's interface

    eval, pdf, eval_pdf = nesting.evaluate, nesting.density, nesting.evaluate_both
    sample = nesting.sample
    eval_diffuse_reflectance = nesting.evaluate_diffuse_reflectance

    def diffracted_value(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask
    ) -> Spectrum:
        """See `Nesting.diffracted_value`."""
        return self.diffracted_both(ctx, si, wo, active)[0]

    def diffracted_density(self, si: Interaction, wo: Vector3f, active: Mask) -> Float:
        """See `Nesting.diffracted_density`."""
        return self.diffracted_both(mi.BSDFContext(), si, wo, active)[1]

    def diffracted_both(
        self, ctx: Context, si: Interaction, wo: Vector3f, active: Mask
    ) -> tuple[Spectrum, Float]:
        """See `Nesting.diffracted_both`."""
        pair = Pair(si, wo, self._frame(si, active), active)
        light = self._lobes.reflected(pair, si, None, ctx)
        return light.value, light.density

    def draw(self, si: Interaction, sample1: Float, sample2: Vector2f, active: Mask) -> Vector3f:
        """Draw an order by its efficiency, and a direction in its lobe; see `Nesting.draw`."""
        return self._drawn(si, sample1, sample2, active)[0]

    def _drawn(
        self, si: Interaction, sample1: Float, sample2: Vector2f, active: Mask
    ) -> tuple[Vector3f, Mask]:
        """Return a direction mirrored to above, z below 0 if invalid, and whether it is below."""
        frame = self._frame(si, active)
        incident = dr.detach(frame.turned(si.wi))
        cos_i = mi.Frame3f.cos_theta(si.wi)
        drawn = self._lobes.draw(incident, cos_i, si, sample1, sample2)
        direction = direction_of(frame.from_table(drawn.uv) - mi.Vector2f(si.wi.x, si.wi.y))
        direction.z = dr.select(drawn.valid, direction.z, -1.0)
        return dr.detach(direction), drawn.below

    def beneath(self, si: Interaction, wo: Vector3f, active: Mask) -> Colour:
        """See `Nesting.beneath`: T(ωi) T(ωo), T = 1 − Σ η_m."""
        inwards, outwards = (
            dr.maximum(1.0 - self._albedo(direction, si, active), 0.0) for direction in (si.wi, wo)
        )
        return inwards * outwards

    def reflected_share(self, si: Interaction, active: Mask) -> Colour:
        """See `Nesting.reflected_share`."""
        return self._albedo(si.wi, si, active)

    def normal_reflectance(self, si: Interaction, active: Mask) -> Spectrum:
        """See `Nesting.normal_reflectance`."""
        return mi.Spectrum(self._albedo(mi.Vector3f(0.0, 0.0, 1.0), si, active))

    def _albedo(self, direction: Vector3f, si: Interaction, active: Mask) -> Colour:
        """Return Σ η_m of light from a direction in the shading frame."""
        tangential = self._frame(si, active).turned(direction)
        return self._lobes.albedo(tangential, mi.Frame3f.cos_theta(direction), si)

    def _frame(self, si: Interaction, active: Mask) -> PatchFrame:
        """Return the axes of the profile at points of the surface."""
        return PatchFrame(self.orientation.rotation(si, active))

    # ------------------------------------------------------------------ changes of parameters

    def traverse(self, callback: Callback) -> None:
        """Expose the orientation and the nested BSDF."""
        self.orientation.traverse(callback)
        if self.nested is not None:
            callback.put("nested", self.nested, mi.ParamFlags.Differentiable)

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

    def describe(self) -> Surface:
        """Return the description of the surface (`description.describe`)."""
        return Surface(
            table=self.table,
            text=str(self.table),
            coherence_width=float(self.coherence_width),
            orientation=self.orientation.quantity,
            frame=lambda si: (*self.orientation.rotation(si, mi.Mask(True)), 1.0),
            nested=None if self.nested is None else Nested(self.nested),
            transmits=self.table.thin,
        )

    def to_string(self) -> str:
        """Describe all parameters, for people."""
        shown: dict[str, Any] = {
            "table": self.table,
            "coherence_width": f"{self.coherence_width:g} µm",
            "orientation": self.orientation,
        }
        if self.nested is not None:
            shown["nested"] = self.nested
        lines = "".join(f"  {name} = {value},\n" for name, value in shown.items())
        return f"DiffractionOrders[\n{lines}]"


def _lobes_of(read: Parameters) -> Lobes:
    """Return the lobes of the current variant."""
    if mi.is_rgb:
        return DaylightLobes(read.table, read.coherence_width)
    kind = PolarisedLobes if mi.is_polarized and read.table.polarised else SpectralLobes
    return kind(read.table, read.coherence_width, read.wavelength)


#: Visible wavelengths, nm, that a table should reach: eyes see less than 1 % of daylight beyond.
_SEEN = (410.0, 690.0)
_warned: list[bool] = []


def _warn_of_wavelengths(table: OrderTable) -> None:
    """Warn of visible light that a table does not reflect."""
    least, most = table.reach
    if not mi.is_monochromatic and (least > _SEEN[0] or most < _SEEN[1]):
        low, high = table.wavelengths
        warn(
            f"this table of orders is of {low:g} to {high:g} nm: it reflects no light below "
            f"{least:.0f} and above {most:.0f} nm; solve it with a wider range of wavelengths"
        )


def _warn_of_polarisation() -> None:
    """Warn once a process."""
    if not _warned:
        _warned.append(True)
        warn(
            "a table of diffraction_orders has no Mueller matrices: in this polarised variant it "
            "depolarises light; solve gratings with polarised=True (thin sheets have none)"
        )
