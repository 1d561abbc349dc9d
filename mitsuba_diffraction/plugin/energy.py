"""Energy conservation, and the light that goes beneath (Dr.Jit): `tables.energy` in a kernel.

All light is multiplied by s(ωi) s(ωo), reciprocal: where the model's albedo exceeds 1, and on both
sides of a surface that lets light through, such that R + T is 1. T = 1 − a(ω) of a dielectric's own
albedo a reaches a nested BSDF.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from ..optics import fresnel
from ..optics.coat import coated_reflectance, cosine_within
from ..optics.geometry import horizon_attenuation
from ..optics.stack import Stacked
from ..progress import show, tracked
from ..tables import DiffractionTable
from ..tables.directional import FINE, DirectionalTable
from ..tables.energy import conserved
from ..tables.energy.conservation import Conservation, Energy, albedo_wavelengths
from .arithmetic import plain
from .boundary import Boundary
from .direction_lookup import DirectionLookup, between, ones_like, scales_of
from .directions import Site
from .energy_factors import ScaleRange
from .layers import Thickness
from .materials import Dielectric, IndexAt
from .types import Colour, Vector3f

#: Indices are rounded to these, real and imaginary part, so that an optimisation of them waits
#: rarely and sees s and the albedo's excess as constants.
INDEX_STEP, COAT_STEP, DIELECTRIC_STEP = 0.05, 0.01, 0.002
#: Step of indices about and below the medium's above, by which light is totally reflected.
TOTAL_STEP = 1e-4
#: Indices that differ from 1 by so many steps at most are rounded to this share of the step.
NEAR, FINE_SHARE = 4.0, 0.02
#: Largest change of a film's fringe by rounding its index, rad: at grazing angles light that a film
#: guides gains several times, within narrow fringes.
FILM_PHASE = 0.02

_SCALES = "scales of energy"  # in progress

#: Material of a surface, or materials of even thicknesses of a film, from the factor on its lengths
#: (`ScaleRange.centre`) and wavelengths, nm.
MaterialsOf = Callable[
    [float, tuple[float, float]], Sequence[conserved.Reflector | conserved.Transmitter]
]
#: Function of direction in a `Conservation` of an energy, by side; None where it is 1 everywhere.
SidesOf = Callable[[Energy, Conservation], list[DirectionalTable] | None]


class EnergyModel:
    """Conserved energy of a BSDF, tabulated for the parameters last set.

    Parameters
    ----------
    wavelength_range : of the table, nm; wavelength : nm, for mono variants.
    materials_of : `reflectors_of` or `dielectric_of`. A reference to the BSDF would be a cycle, and
        keep the table.
    conserving : whether light is multiplied by s.
    beneath : whether light that is not reflected goes on to a nested BSDF, by the albedo.
    thickness : of a film by a texture, or None.
    """

    def __init__(
        self,
        wavelength_range: tuple[float, float],
        wavelength: float,
        materials_of: MaterialsOf,
        *,
        conserving: bool,
        beneath: bool = False,
        thickness: Thickness | None = None,
    ) -> None:
        mono = wavelength, wavelength
        self._materials_of, self._thickness = materials_of, thickness
        self._range = mono if mi.is_monochromatic else wavelength_range
        self.conserving, self.beneath = conserving, beneath
        self._scale: DirectionLookup | None = None
        self._excess: DirectionLookup | None = None
        self._ones: list[DirectionalTable] | None = None

    def update(self, table: DiffractionTable, factors: ScaleRange) -> None:
        """Look up, or compute, what belongs to a table, factors on it and the material.

        table : of the BSDF, the mean over all positions of the window.

        Values are linear between height scales, 1 among them. At a height scale their derivative
        is taken from the interval above. While derivatives are taken, scales of 1 stand for none
        after there were some: an optimisation compiles no other kernel.
        """
        self._factors, wavelengths = factors, factors.wavelengths(self._range)
        if self._thickness is not None and self.beneath and mi.is_spectral:
            first, second, *_ = albedo_wavelengths(wavelengths).tolist()
            self._thickness.beyond = second / first
        materials = self._materials_of(factors.centre, self._range)
        self._both_sides = isinstance(materials[0], conserved.Transmitter)
        filmed = materials[0].phase(wavelengths) > 0.0
        # many thicknesses, at each fringe, would take minutes: see `DirectionLookup`
        fringes = self.beneath and self._thickness is None
        self._energies = [
            Energy(table, material, wavelengths, factors.least, fringes) for material in materials
        ]
        if self.conserving:
            nodes, scales = self._nodes(_scales_of)
            if scales is None and factors.differentiable and self._ones is not None:
                scales = [self._ones] * len(nodes)
            if scales is not None and factors.differentiable:
                self._ones = ones_like(scales[0])
            self._scale = (
                None if scales is None else
                DirectionLookup(
                    scales, nodes, factors, self._thickness, exponent=-2.0, filmed=filmed
                )
            )  # fmt: skip
        if self.beneath:
            nodes, excesses = self._nodes(_excess_of)
            assert excesses is not None
            self._excess = DirectionLookup(
                excesses, nodes, factors, self._thickness,
                fringes=mi.is_spectral, filmed=filmed,
            )  # fmt: skip

    def _nodes(
        self, sides_of: SidesOf
    ) -> tuple[list[float], Sequence[Sequence[DirectionalTable]] | None]:
        """Return nodes, of height scales or thicknesses, nm, and a function's tables at them."""
        if self._thickness is None:
            nodes = self._factors.nodes(self._energies[0])
            energies = tracked([self._at_node(node) for node in nodes], show, _SCALES)
            found = zip(energies, nodes, strict=True)
            return nodes, scales_of([sides_of(each, each.at(node)) for each, node in found])
        height, energies = self._factors.height_scale, tracked(self._energies, show, _SCALES)
        thicknesses = np.linspace(*self._thickness.tabulated, len(self._energies)).tolist()
        return thicknesses, scales_of([_at_height(each, sides_of, height) for each in energies])

    def _at_node(self, height_scale: float) -> Energy:
        """Return the energy with the indices of the light at the stretch of a height scale."""
        (energy,), stretch = self._energies, self._factors.stretch_at(height_scale)
        if stretch == self._factors.centre:
            return energy
        (material,) = self._materials_of(stretch, self._range)
        return replace(energy, material=material)

    def scale(self, height_scale: float) -> DirectionalTable | None:
        """Return s on `FINE`, for shaders; None where all values are 1."""
        found = self._tabulated(_scales_of, height_scale) if self.conserving else None
        return None if found is None else found.on(FINE)

    def excess(self, height_scale: float) -> DirectionalTable | None:
        """Return the table of `albedo_excess`, for shaders; None without `beneath`."""
        return self._tabulated(_excess_of, height_scale) if self.beneath else None

    @property
    def scales(self) -> bool:
        """Whether the BSDF is multiplied by `factor`."""
        return self.conserving and (self._both_sides or self._scale is not None)

    def kernel_constants(self) -> tuple[object, ...]:
        """Plain values that choose kernels, as of `PluginBSDF.kernel_constants`."""
        return self.scales, self._scale is not None

    def factor(self, site: Site, wo: Vector3f) -> Colour:
        """Return s(ωi) s(ωo) per channel, less at the horizon."""
        product, horizon = mi.UnpolarizedSpectrum(1.0), mi.Float(1.0)
        for direction in (site.si.wi, wo):
            if self._scale is not None:
                product *= mi.UnpolarizedSpectrum(self._scale.at(direction, site))
            cosine = mi.Frame3f.cos_theta(direction)
            horizon *= horizon_attenuation(dr.abs(cosine) if self._both_sides else cosine)
        return product * horizon

    def albedo_excess(self, direction: Vector3f, site: Site) -> Colour:
        """Return a(ω) less the flat interface's reflectance, per channel; 0 without `beneath`."""
        if self._excess is None:
            return mi.UnpolarizedSpectrum(0.0)
        return mi.UnpolarizedSpectrum(self._excess.at(direction, site))

    def _tabulated(self, sides_of: SidesOf, height_scale: float) -> DirectionalTable | None:
        """Return the function that a look-up shows above the surface; None where it is 1.

        Where a film varies, that of the thinnest: no shader shows it.
        """
        centre = self._factors.centre
        sides = _at_height(self._energies[0], sides_of, height_scale / centre)
        if sides is None:
            return None
        return DirectionalTable(sides[0].wavelengths * centre, sides[0].values)


def _at_height(
    energy: Energy, sides_of: SidesOf, height_scale: float
) -> list[DirectionalTable] | None:
    """Interpolate a function between the nodes around a height scale; None where it is 1."""
    nodes = energy.nodes(height_scale, height_scale)
    tables = scales_of([sides_of(energy, energy.at(node)) for node in nodes])
    if tables is None:
        return None
    return [between(side, nodes, height_scale) for side in zip(*tables, strict=True)]


def _scales_of(energy: Energy, found: Conservation) -> list[DirectionalTable] | None:
    return found.scales


def _excess_of(energy: Energy, found: Conservation) -> list[DirectionalTable]:
    """Return the albedo less the flat reflectance (`SidesOf`).

    A difference, because a film may reflect next to nothing where its rough surface reflects light.
    """
    albedo, material = found.albedo, energy.material
    assert albedo is not None
    assert isinstance(material, conserved.Reflector)
    index: Any = material.index(albedo.wavelengths)
    cosine, coat = np.cos(albedo.grid.theta), np.asarray(material.coat)
    flat = fresnel.reflectance(cosine_within(cosine, coat), index[:, None])
    flat = coated_reflectance(fresnel.reflectance(cosine, coat), flat)
    values = albedo.values - flat[:, :, None]
    if material.total(index):  # the excess has a peak just below the critical angle
        values = scipy.ndimage.maximum_filter1d(values, 3, axis=1)
    return [DirectionalTable(albedo.wavelengths, values.astype(np.float32))]


def reflectors_of(
    boundary: Boundary,
    coat: Dielectric | None,
    centre: float,
    wavelength_range: tuple[float, float],
) -> list[conserved.Reflector]:
    """Return the materials of a surface that reflects, under a coat or none (`MaterialsOf`)."""
    exact = 1.0 if coat is None else plain(coat.eta)
    index = 1.0 if coat is None else float(rounded_index(exact, COAT_STEP))
    how = (exact, index), centre, wavelength_range
    return [
        conserved.Reflector(boundary.model.name, partial(_rounded_indices, at, *how), index)
        for at in boundary.material.everywhere()
    ]


def dielectric_of(
    boundary: Boundary,
    material: Dielectric,
    thin: bool,
    centre: float,
    wavelength_range: tuple[float, float],
) -> list[conserved.Transmitter]:
    """Return the material of an interface or a thin sheet (`MaterialsOf`)."""
    index = float(rounded_index(plain(material.eta), DIELECTRIC_STEP))
    return [conserved.Transmitter(index, boundary.model.name, thin)]


def _rounded_indices(
    at: IndexAt,
    coat: tuple[float, float],
    centre: float,
    wavelength_range: tuple[float, float],
    wavelengths: NDArray[np.float64],
) -> Any:
    """Return indices to `INDEX_STEP`, of the light that tables have at these wavelengths.

    at : `Material.at` of a thickness.
    coat : index of the coat, as it is and rounded; 1 without one.
    centre : factor on lengths, `ScaleRange.centre`; wavelength_range : of the light, nm.
    """
    exact = at(np.clip(wavelengths * centre, *wavelength_range))
    if exact is None or isinstance(exact, Stacked):
        return exact
    if isinstance(exact, fresnel.Filmed):
        index, film, depth = exact.parts
        phase = FILM_PHASE / max(float(np.max(np.real(depth))), 1e-9)
        fine = min(INDEX_STEP, 10.0 ** math.floor(math.log10(phase)))  # of decimal numbers as given
        return fresnel.Filmed(_under(coat, index), rounded_index(film, fine), depth)
    return _under(coat, exact)


def _under(coat: tuple[float, float], index: ArrayLike) -> NDArray[Any]:
    """Return indices relative to a coat to `INDEX_STEP`, or to `TOTAL_STEP` about and below 1.

    coat : its index as it is, and rounded. The product with the index says from which angle on
        light from above is totally reflected, and a rounded one would move it.
    """
    values = np.asarray(index)
    above = values * coat[0]
    total = (np.real(above) < 1.0 + NEAR * INDEX_STEP) & (np.abs(np.imag(above)) < INDEX_STEP)
    fine = np.maximum(np.round(np.real(above) / coat[1] / TOTAL_STEP), 1.0) * TOTAL_STEP
    return np.where(total, fine + 1j * np.imag(values), rounded_index(values, INDEX_STEP))


def rounded_index(index: ArrayLike, step: float) -> NDArray[Any]:
    """An index to a step, finer where it is close to 1, but not to 0, where no wave exists."""
    values = np.asarray(index)
    contrast, fine = np.abs(values - 1.0), FINE_SHARE * step
    rounded = np.where(
        contrast > NEAR * step, np.round(values / step) * step, np.round(values / fine) * fine
    )
    return np.where(rounded == 0.0, step, rounded)
