"""The Mitsuba BSDF plugin `diffraction_orders`: gratings whose orders were solved.

For steep grooves, most of all of metal: a CD, a blazed grating, an embossed hologram.
`mitsuba-diffraction solve` makes the table ([orders.md](orders.md)). The profile repeats along x.

The grating
-----------
filename : string
    File of `mitsuba-diffraction solve`, or of `save` of a table.
data : OrderTable
    Instead: a table, in dictionaries only, by `md.bsdf_dict`.
coherence_width : float or string [auto]
    Width over which light is coherent, µm, at least 2 of the longer periods; sets the width of the
    lobes. `auto`: 65 (sunlight).
orientation : float or texture ∂ [0]
    Angle in degrees from the first tangent to the direction in which the profile repeats, as of
    `diffraction`.
wavelength : float [550]
    Wavelength of mono variants, nm.
(nested) : BSDF ∂
    Base BSDF beneath a dielectric grating, which receives the light in no order: T(ωi) T(ωo), T = 1
    − Σ η_m. Not for metals.

The model is a sum of lobes, one for each order m, of the efficiency η_m of the table:

    f = Σ_m η_m(ωi, λ) (k²σ²/π) exp(−σ²|q − q_m|²),   q = k (u, v),   q_m = (2πm/d, 0)

with q_m = 2π (m_x/d_x, m_y/d_y) of crossed gratings.

The table's clear layer (superstrate) is a coat with a flat face: a mirror of the same coherence
width. Light that the face sends back to the grating is summed over all orders and reflections, in
powers. RGB variants sum f over daylight. Polarised variants have the Mueller matrices of a table of
`solve --polarised`; with another table they depolarise the light, and warn once. Wavelengths
outside the table by less than a tenth of an octave have the efficiencies of the nearest in it;
other light is not reflected, which is warned of where it is visible. f is reciprocal as far as the
table is, at the centres of lobes.

A table of a thin sheet (`solve --thin`) makes the BSDF a sheet, with the grating on the side that
normals point to. A table of a block (`solve --block`) makes it the block's face, with the table's
index, in place of `dielectric`. Both reflect and transmit light from either side, nest no BSDF, and
depolarise light. Component 0 is the reflection, component 1 the transmission.

XML and the same in Python:

    <bsdf type="diffraction_orders">
        <string name="filename" value="grating.nc"/>
        <float name="orientation" value="90"/>
    </bsdf>

    import mitsuba_diffraction as md  # before Mitsuba: registers the plugin
    import mitsuba as mi

    mi.set_variant("llvm_ad_spectral")
    md.OrderTable.mirror(period=1.6, reflectance=0.9).save("grating.nc")
    bsdf = mi.load_dict({"type": "diffraction_orders", "filename": "grating.nc", "orientation": 90})
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import drjit as dr
import mitsuba as mi

from ...errors import DiffractionError, warn
from ...heights.lengths import is_auto
from ...optics.geometry import sigma_of
from ...plugin.base import SurfaceBSDF, asked_sides
from ...plugin.description import Surface
from ...plugin.dictionary import ORDERS, Data
from ...plugin.directions import Pair, PatchFrame, Site
from ...plugin.parameters import mono_wavelength, nested_of, orientation_of
from ...plugin.properties import class_of, resolved_path
from ...plugin.sampling import direction_of
from ...plugin.types import (
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
from ...settings import USUAL_WIDTH, checked
from ..file import loaded_orders
from ..table import OrderTable
from .daylight_lobes import DaylightLobes
from .lobes import OrderLobe, SpectralLobes
from .polarised_lobes import PolarisedLobes

#: Periods that the coherence window spans at least: in a narrower one orders are no lobes.
LEAST_PERIODS = 2.0


class DiffractionOrders(SurfaceBSDF):
    """Reflection by a grating with solved orders; of a sheet or a block's face transmission, too.

    Both sides of a sheet have the same medium. In a block, look-ups and draws work with tangential
    parts of wave vectors over 2π/λ, n ωi and n ωo, which orders change alike on both sides.

    Attributes
    ----------
    table : efficiencies of the orders.
    orientation : angle from the first tangent to the patch's x axis.
    """

    title = "DiffractionOrders"

    def __init__(self, props: Properties) -> None:
        nested = nested_of(props, ORDERS)
        self.table = _table_of(props)
        if self.table.sides == 2 and nested is not None:
            kind = "thin sheet" if self.table.thin else "block"
            raise DiffractionError(
                f"the table is that of a {kind}, beneath which no BSDF ({class_of(nested)}) lies; "
                f"put a surface behind the {kind} instead"
            )
        super().__init__(props, nested)
        self.coherence_width = _coherence_width_of(props, self.table)
        self.orientation, self.transmits = orientation_of(props), self.table.sides == 2
        window = OrderLobe(self.table, self.coherence_width)
        self._lobes = _lobes_of(window, mono_wavelength(props, self.table.wavelengths))
        self.parameters.append(self.orientation)
        if mi.is_polarized and not self.table.polarised:
            _warn_of_polarisation()
        _warn_of_wavelengths(self.table)
        self.ready()

    @property
    def sigma(self) -> float:
        """Standard deviation of the amplitude window, µm."""
        return sigma_of(self.coherence_width)

    @property
    def media_differ(self) -> bool:
        """See `SurfaceBSDF.media_differ`."""
        return bool(self.table.block)

    def relative_index(self, cos_i: Float, cos_o: Float) -> Float:
        """See `SurfaceBSDF.relative_index`."""
        return self._index(cos_o > 0.0) / self._index(cos_i > 0.0)

    def _index(self, above: Mask) -> Float:
        """Return the index of the medium on a side over that above."""
        return dr.select(above, mi.Float(1.0), self.table.block) if self.table.block else 1.0

    # ------------------------------------------------------------------ the diffraction

    def site_at(self, si: Interaction, active: Mask) -> Site:
        """See `SurfaceBSDF.site_at`."""
        return Site(si, PatchFrame(self.orientation.rotation(si, active)))

    def diffracted(
        self, ctx: Context, site: Site, wo: Vector3f, active: Mask, kinds: str
    ) -> tuple[Spectrum, Float]:
        """See `SurfaceBSDF.diffracted`; of two sides, those of the requested components."""
        if not self.transmits:
            return self._lobes.reflected(Pair(site.si, wo, site.frame, active), site.si, None, ctx)
        cos_i, cos_o = mi.Frame3f.cos_theta(site.si.wi), mi.Frame3f.cos_theta(wo)
        lit = active & (cos_i * cos_o != 0.0) & requested(ctx, cos_i * cos_o < 0.0)
        came, left = self._index(cos_i > 0.0), self._index(cos_o > 0.0)
        pair = Passage(site, wo, lit, (came, left), self._first_side)
        below = self._first_side * cos_o < 0.0
        value, density = self._lobes.reflected(pair, site.si, below, ctx)
        if self.table.block and ctx.mode == mi.TransportMode.Radiance:
            value = value * dr.square(came / left)  # radiance over n² is transmitted
        return dr.select(lit, value, 0.0), dr.select(lit, density, 0.0)

    @property
    def _first_side(self) -> float:
        """Sign of the cosine on the first side of a table: above, or within a block."""
        return -1.0 if self.table.block else 1.0

    def draw(self, ctx: Context, site: Site, sample1: Float, sample2: Vector2f) -> Vector3f:
        """Draw a side and an order by its efficiency, and a direction in its lobe.

        A context for one component has no light where the other one is drawn.
        """
        wi, cos_i = site.si.wi, mi.Frame3f.cos_theta(site.si.wi)
        came = self._index(cos_i > 0.0)
        incident = dr.detach(site.frame.turned(came * wi))
        drawn = self._lobes.draw(incident, self._first_side * cos_i, site.si, sample1, sample2)
        tangential = site.frame.from_table(drawn.uv) - came * mi.Vector2f(wi.x, wi.y)
        above = mi.Mask(drawn.below) ^ (not self.table.block) if self.transmits else mi.Mask(True)
        wo = direction_of(tangential / self._index(above) if self.table.block else tangential)
        wo.z = dr.select(drawn.valid, dr.maximum(wo.z, 0.0), 0.0)
        if self.transmits:
            wo.z = dr.select(above, wo.z, -wo.z)
        return dr.detach(wo)

    def beneath(self, site: Site, wo: Vector3f, active: Mask) -> Colour:
        """See `SurfaceBSDF.beneath`: T(ωi) T(ωo), T = 1 − Σ η_m."""
        inwards, outwards = (
            dr.maximum(1.0 - self._albedo(direction, site), 0.0) for direction in (site.si.wi, wo)
        )
        return inwards * outwards

    def reflected_share(self, site: Site, active: Mask) -> Colour:
        """See `SurfaceBSDF.reflected_share`."""
        return self._albedo(site.si.wi, site)

    def _albedo(self, direction: Vector3f, site: Site) -> Colour:
        """Return Σ η_m of light from a direction in the shading frame."""
        tangential = site.frame.turned(direction)
        return self._lobes.albedo(tangential, mi.Frame3f.cos_theta(direction), site.si)

    # ------------------------------------------------------------------ the surface

    def kernel_constants(self) -> tuple[object, ...]:
        """See `PluginBSDF.kernel_constants`."""
        return self.table.digest(), self.coherence_width

    def describe(self) -> Surface:
        """Return the description of the surface (`description.describe`)."""
        return Surface(
            table=self.table,
            text=str(self.table),
            coherence_width=float(self.coherence_width),
            orientation=self.orientation.quantity,
            frame=lambda si: (*self.orientation.rotation(si, mi.Mask(True)), 1.0),
            nested=self.nested,
            transmits=self.transmits,
        )

    def shown(self) -> dict[str, Any]:
        """See `PluginBSDF.shown`."""
        shown: dict[str, Any] = {
            "table": self.table,
            "wavelengths": "{:.1f} to {:.1f} nm".format(*self.table.reach),
            "coherence_width": f"{self.coherence_width:g} µm",
            "orientation": self.orientation,
        }
        if self.nested is not None:
            shown["nested"] = self.nested
        return shown


class Passage(Pair):
    """Pair of directions on any sides of a sheet or a face, as lobes take it.

    Attributes
    ----------
    uv, incident : n ωi + n ωo and n ωi, tangential, in the patch's frame.
    cos_i : cosine of ωi, above 0 on the first side of the table.
    cos_o : n² |cosθo|, by which densities over tangential parts become those per solid angle.
    """

    def __init__(
        self, site: Site, wo: Vector3f, lit: Mask, indices: tuple[Float, Float], first_side: float
    ) -> None:
        super().__init__(site.si, wo, site.frame, lit)
        self._came, left = indices
        self.uv = site.frame.to_table(self._came * site.si.wi + left * wo)
        self.cos_i = dr.select(lit, first_side * mi.Frame3f.cos_theta(site.si.wi), 1.0)
        self.cos_o = dr.square(left) * dr.abs(mi.Frame3f.cos_theta(wo))

    @cached_property
    def incident(self) -> Vector2f:
        """See `Pair.incident`."""
        return self.frame.turned(self._came * self.wi)


def requested(ctx: Context, passed: Mask) -> Mask:
    """Mask of the lanes whose component a context asks for; passed : whether light goes through."""
    reflection, transmission = map(mi.Mask, asked_sides(ctx))
    return dr.select(passed, transmission, reflection)


def _table_of(props: Properties) -> OrderTable:
    """Load the table; raises a DiffractionError with the parameter and the choices."""
    if ("filename" in props) == ("data" in props):
        raise DiffractionError(
            f"{ORDERS} takes one of filename, a file of orders, and data, an "
            "OrderTable of md.bsdf_dict"
        )
    if "data" in props:
        data = props.get("data")
        if not isinstance(data, Data) or not isinstance(data.value, OrderTable):
            raise DiffractionError("data must be an OrderTable; pass it to md.bsdf_dict")
        return data.value
    name = props.get("filename")
    if not isinstance(name, str):
        raise DiffractionError(f"filename={name!r} must be the name of a file")
    return loaded_orders(resolved_path(name, "filename"))


def _coherence_width_of(props: Properties, table: OrderTable) -> float:
    """Return the coherence width, µm.

    Raises a DiffractionError with the value and the least one.
    """
    value = props.get("coherence_width", "auto")
    width = USUAL_WIDTH if is_auto(value) else checked("coherence_width", value)
    if width < LEAST_PERIODS * table.period:
        raise DiffractionError(
            f"coherence_width={width:g} µm must be at least {LEAST_PERIODS:g} periods of the "
            f"grating, {LEAST_PERIODS * table.period:g} µm: narrower windows have no orders"
        )
    return float(width)


def _lobes_of(window: OrderLobe, wavelength: float) -> SpectralLobes | DaylightLobes:
    """Return the lobes of the current variant."""
    if mi.is_rgb:
        return DaylightLobes(window)
    if mi.is_polarized and window.lookup.numbers and window.lookup.sides == 1:
        return PolarisedLobes(window, wavelength)
    return SpectralLobes(window, wavelength)


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


mi.register_bsdf("diffraction_orders", DiffractionOrders)
