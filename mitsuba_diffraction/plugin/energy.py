"""Energy conservation, and the light that goes beneath (Dr.Jit): `tables.energy` in a kernel.

The reflected power is multiplied by s(ωi) s(ωo), reciprocal, where the model's albedo exceeds 1.
T = 1 − a(ω) of a dielectric's own albedo a reaches a nested BSDF.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..optics import fresnel
from ..optics.colour import RGB_WAVELENGTHS
from ..optics.mean_second_order import limited
from ..optics.stack import Stacked
from ..tables.directional import FINE, DirectionalTable
from ..tables.energy.conservation import Conservation, Energy
from ..tables.energy.conserved import Reflector
from ..tables.film import exponents_at, mean_exponents
from ..tables.table import DiffractionTable
from .boundary import Boundary
from .direction_lookup import DirectionLookup, at_horizon, between, scales_of
from .directions import Pair, PatchFrame
from .energy_factors import ScaleRange
from .fresnel import Dielectric, Inside, Perfect, Reflectance
from .layers import UnderFilm, plain
from .memory import upload
from .stack import UnderStack
from .types import Colour, Float, Vector3f

Array = NDArray[np.float32]
#: Of wavelengths (n,).
Indices = NDArray[np.complex128] | fresnel.Filmed | Stacked

#: Indices are rounded to this, real and imaginary part, for s and the ratio of albedos.
INDEX_STEP = 0.05
#: For g.
FILM_STEP = 0.01
#: For a coat.
COAT_STEP = 0.01
#: Largest change of a film's fringe by rounding its index, rad: at grazing angles light that a film
#: guides gains several times, within narrow fringes.
FILM_PHASE = 0.02
#: A film's thickness is rounded to this, nm, which changes the fringe by as much.
THICKNESS_STEP = 1.0
#: Step of a height scale over which the slope of g is taken. g bends by less than 1e-3 of its slope
#: over it, and single precision leaves four digits of the difference.
SLOPE_STEP = 2.0**-9
#: Largest ratio of a film's albedo to that of the flat one.
MOST_RATIO = 2.0


class EnergyModel:
    """Scales of directions and albedo of a BSDF, at the height scale and material last set.

    Parameters
    ----------
    table, boundary : of the BSDF.
    wavelength : nm, for mono variants.
    conserving : whether anything is to be taken.
    coat : the clear layer over the structure, or None.
    """

    def __init__(
        self,
        table: DiffractionTable,
        boundary: Boundary,
        wavelength: float,
        conserving: bool,
        coat: Dielectric | None = None,
    ) -> None:
        mono = wavelength, wavelength
        self._table, self._model = table, str(boundary)
        self._range = mono if mi.is_monochromatic else table.wavelength_range
        self.conserving, self._material = conserving, boundary.material
        self._coat = coat
        self._filmed = isinstance(self._material, UnderFilm) and boundary.model.has_second_order
        self._scale, self._mean = DirectionLookup(), DirectionLookup()
        self._reflected = DirectionLookup()

    def update(self, scales: ScaleRange, beneath: bool) -> None:
        """Look up, or compute, what belongs to other factors or another material.

        s is linear between height scales, 1 among them. At a height scale its derivative is taken
        from the interval above; g has derivatives of its own.

        scales : the factors; beneath : whether light goes on to something.
        """
        self._scales = scales
        # of the material alone: a reference to this object would be a cycle, and keep the table
        self._indices, self._exact = (
            partial(_indices_under, self._material, step, scales.centre, self._range)
            for step in (INDEX_STEP, FILM_STEP)
        )
        material = Reflector(self._model, self._indices, self._coat_index)
        wavelengths = scales.wavelengths(self._range)
        self._energy = Energy(self._table, material, wavelengths, scales.least)
        if not (self.conserving or beneath or self._filmed):
            return
        nodes = scales.nodes(self._energy)
        if self._filmed:
            # g costs little at any height scale: its slope is taken there, and not from nodes of s,
            # on both sides of which it differs by some per cent
            height_scale = scales.height_scale
            near = [height_scale, height_scale + (SLOPE_STEP if scales.differentiable else 0.0)]
            around = nodes if scales.varies else near
            exponents = mean_exponents(self._table, self._exact, self._energy.wavelength_range)
            gains = [_gain(exponents, node) for node in around]
            self._mean.update(gains, around, scales, self._mean_slopes(exponents, around))
        if not (self.conserving or beneath):
            return
        conserved = [self._energy.at(node) for node in nodes]
        if self.conserving:
            self._scale.update(scales_of([energy.scale for energy in conserved]), nodes, scales)
        if beneath:
            ratios = [self._ratio(energy) for energy in conserved]
            self._reflected.update(ratios, nodes, scales)

    @property
    def _coat_index(self) -> float:
        """Index of the coat, rounded; 1 without a coat."""
        if self._coat is None:
            return 1.0
        return float(rounded_index(plain(self._coat.eta), COAT_STEP))

    def scale(self, height_scale: float) -> DirectionalTable | None:
        """Energy scale s on `FINE`; None where all are 1."""
        height_scale /= self._scales.centre
        nodes = self._energy.nodes(height_scale)
        conserved = [self._energy.at(node) for node in nodes]
        scales = scales_of([energy.scale for energy in conserved])
        if scales is None:
            return None
        scale = between([scale.on(FINE) for scale in scales], nodes, height_scale)
        return DirectionalTable(scale.wavelengths * self._scales.centre, scale.values)

    def ratio(self, height_scale: float) -> DirectionalTable:
        """Return the table that `reflected` looks up, for shaders."""
        height_scale /= self._scales.centre
        nodes = self._energy.nodes(height_scale)
        ratios = [self._ratio(self._energy.at(node)) for node in nodes]
        ratio = between(ratios, nodes, height_scale)
        return DirectionalTable(ratio.wavelengths * self._scales.centre, ratio.values)

    @property
    def active_factors(self) -> int:
        """Factors that the BSDF is multiplied by: 1 energy scale, 2 mean second order, 3 both."""
        return self._scale.present + 2 * self._mean.present

    def factor(self, pair: Pair, wavenumbers: list[Float], height_scale: Float) -> Colour:
        """Return s(ωi) s(ωo) per channel; of a film g(ωi) g(ωo) too (`optics.mean_second_order`).

        height_scale : the one given to `update`; needed where derivatives with respect to it are,
            and where it varies.
        """
        outer = pair.outer
        product = mi.UnpolarizedSpectrum(1.0)
        for lookup in (self._scale, self._mean):
            if lookup.present:
                both = zip(
                    lookup.at(outer.wi, outer.cos_i, outer.frame, wavenumbers, height_scale),
                    lookup.at(outer.wo, outer.cos_o, outer.frame, wavenumbers, height_scale),
                    strict=True,
                )
                product *= mi.UnpolarizedSpectrum(
                    [incident * outgoing for incident, outgoing in both]
                )
        if self._scale.present:
            product *= at_horizon(outer.cos_i) * at_horizon(outer.cos_o)
        return product

    def reflected(
        self,
        direction: Vector3f,
        frame: PatchFrame,
        wavenumbers: list[Float],
        height_scale: Float,
    ) -> Colour:
        """a(ω) over the flat interface's reflectance, per channel; `update` was told `beneath`."""
        cosine = mi.Frame3f.cos_theta(direction)
        return mi.UnpolarizedSpectrum(
            self._reflected.at(direction, cosine, frame, wavenumbers, height_scale)
        )

    def _mean_slopes(
        self, exponents: DirectionalTable, nodes: list[float]
    ) -> list[tuple[Float, list[DirectionalTable]]]:
        """Derivatives of g at height scales with respect to numbers of the film that have them."""
        wavelengths = exponents.wavelengths
        film, light = self._exact(wavelengths), wavelengths * self._scales.centre
        assert isinstance(film, fresnel.Filmed)
        assert isinstance(self._material, UnderFilm)
        slopes = []
        for number, step, changed in self._material.changes(film, light):
            moved = exponents_at(self._table.roughness, changed, wavelengths)
            ends = ((_gain(exponents, node), _gain(moved, node)) for node in nodes)
            rates = [(after.values - before.values) / step for before, after in ends]
            slopes.append((number, [DirectionalTable(wavelengths, rate) for rate in rates]))
        return slopes

    def _ratio(self, conserved: Conservation) -> DirectionalTable:
        albedo = conserved.albedo
        assert albedo is not None  # of a reflector
        index = self._indices(albedo.wavelengths)
        assert index is not None  # without an index no light goes beneath
        flat = fresnel.reflectance(np.cos(albedo.grid.theta), index[:, None])
        # of an index of 1 there is neither
        ratio = np.where(flat > 1e-9, 1.0 / np.maximum(flat, 1e-9), 0.0)[:, :, None]
        values = albedo.values * ratio
        if isinstance(index, fresnel.Filmed | Stacked):  # which may reflect next to nothing
            values = np.minimum(values, MOST_RATIO)
        return DirectionalTable(albedo.wavelengths, values.astype(np.float32))


def _gain(exponents: DirectionalTable, height_scale: float) -> DirectionalTable:
    """g at a height scale, from ln g at 1."""
    values = limited(exponents.values * height_scale**2).astype(np.float32)
    return DirectionalTable(exponents.wavelengths, values)


def indices_of(
    material: Reflectance | Inside | UnderFilm | UnderStack, wavelengths: NDArray[np.float64]
) -> Indices | None:
    """n + ik of a material at wavelengths (n,), nm, in the variant's colours; None for R = 1."""
    if isinstance(material, Perfect):
        return None
    if isinstance(material, UnderStack):
        return material.at(wavelengths)
    if isinstance(material, UnderFilm):
        index = indices_of(material.material, wavelengths)
        assert isinstance(index, np.ndarray)
        film, thickness = material.numbers()
        rounded = _rounded(thickness, THICKNESS_STEP)
        return fresnel.Filmed(index, film, 2.0 * np.pi * rounded / wavelengths)
    indices = []
    # one look-up of all wavelengths in a kernel, or one for each
    at_once = not mi.is_spectral or dr.is_jit_v(mi.Float)
    for light in [wavelengths] if at_once else wavelengths[:, None]:
        si = dr.zeros(mi.SurfaceInteraction3f, len(light) if mi.is_spectral else 1)
        if mi.is_spectral:
            values = upload(mi.Float, light.astype(np.float32)) if at_once else float(light[0])
            si.wavelengths = mi.UnpolarizedSpectrum(values)
        indices.append([_complex(n) for n in material.indices(si, True)])
    if not mi.is_rgb:
        values = np.concatenate([channels[0] for channels in indices])
        return np.broadcast_to(values, wavelengths.shape)
    colours = np.broadcast_to(np.ravel(indices[0]), len(RGB_WAVELENGTHS))
    return np.interp(wavelengths, RGB_WAVELENGTHS[::-1], colours[::-1])


def _indices_under(
    material: Reflectance | Inside | UnderFilm | UnderStack,
    step: float,
    centre: float,
    wavelength_range: tuple[float, float],
    wavelengths: NDArray[np.float64],
) -> Indices | None:
    """Return indices to a step, of the light that tables have at these wavelengths.

    centre : factor on lengths, `ScaleRange.centre`; wavelength_range : of the light, nm.
    """
    light = np.clip(wavelengths * centre, *wavelength_range)
    return _rounded_indices(material, step, light)


def _rounded(value: ArrayLike, step: float) -> NDArray[Any]:
    return np.asarray(np.round(np.asarray(value) / step) * step)


def _rounded_indices(
    material: Reflectance | Inside | UnderFilm | UnderStack,
    step: float,
    wavelengths: NDArray[np.float64],
) -> Indices | None:
    """`indices_of`, to a step: an optimisation of them waits rarely, and sees s and the ratio of
    albedos as constants; g under a film has derivatives with respect to the film's numbers.
    """
    exact = indices_of(material, wavelengths)
    if exact is None or isinstance(exact, Stacked):
        return exact
    if isinstance(exact, fresnel.Filmed):
        index, film, depth = exact.parts
        phase = FILM_PHASE / max(float(np.max(np.real(depth))), 1e-9)
        fine = min(step, 10.0 ** math.floor(math.log10(phase)))  # of decimal numbers as given
        return fresnel.Filmed(rounded_index(index, step), rounded_index(film, fine), depth)
    return rounded_index(exact, step)


def rounded_index(index: ArrayLike, step: float) -> NDArray[Any]:
    """An index to a step, finer where it is close to 1, but not to 0, where no wave exists."""
    contrast = np.abs(np.asarray(index) - 1.0)
    rounded = np.where(contrast > 4.0 * step, _rounded(index, step), _rounded(index, 0.02 * step))
    return np.where(rounded == 0.0, step, rounded)


def _complex(number: Float) -> NDArray[np.complex128]:
    """Return a number of each lane as an array (lanes,)."""
    real, imaginary = (
        (number.real, number.imag) if dr.is_complex_v(number) else (number, mi.Float(0.0))
    )
    lanes = (np.array(dr.detach(part), np.float64).ravel() for part in (real, imaginary))
    return np.asarray(next(lanes) + 1j * next(lanes))
