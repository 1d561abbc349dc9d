"""Colours of the light that a patch diffracts out of the mirror's lobe, and how much they change.

They are computed from the orders of a table and not from the pixels of a map, so that they depend
neither on a resolution nor, above `WINDOW`, on the coherence width.

References
----------
M. G. Meadows, N. I. Morehouse, R. L. Rutowski, J. M. Douglas and K. J. McGraw, Quantifying
iridescent coloration in animals, Behavioral Ecology and Sociobiology 65, 1317-1327 (2011).
H. Gruson, C. Andraud, W. Daney de Marcillac, S. Berthier, M. Elias and D. Gomez, Quantitative
characterization of iridescent colours in biological studies, Interface Focus 9, 20180049 (2019).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from matplotlib.colors import rgb_to_hsv
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates, median

from ..arrays import Real
from ..errors import DiffractionError
from ..optics.colour import linear_srgb, response
from ..optics.geometry import sigma_of, wavenumber
from ..tables import DiffractionTable
from ..tables.powers import as_powers, order_0_power
from .maps.hemisphere import flat_interaction, vectors
from .maps.result import LightDirection

#: Coherence width of the index, µm; its lobes are 3.3° wide (half maximum, 550 nm, at the normal),
#: about the acceptance of a fibre. It is the narrowest window that whole scans are used with.
WINDOW = 10.0
#: Names of the sextants of hue, from red on, each 60° wide in HSV.
HUES = ("red", "yellow", "green", "cyan", "blue", "magenta")
#: Saturation below which a colour counts as grey.
GREY = 0.1

#: Unordered surfaces of which `light_and_chance` takes the mean.
CHANCES = 3

#: Range of wavelengths that the index covers, nm, and their step: an order moves by less than a
#: lobe from one to the next.
SHORTEST, LONGEST, STEP = 380.0, 780.0, 10.0
# Values of κ at which series are evaluated: phases of relief are off by κH/20000.
_NODES = 10000
# Side of a direction's cell, in sines: at most the narrowest lobe's standard deviation, a scan's.
_CELL = 0.008
# Luminance, relative to the brightest direction, below which a direction has no colour.
_DARK = 1e-9


@dataclass(frozen=True)
class DiffractedLight:
    """Light that leaves a patch outside the mirror's lobe, by direction.

    Attributes
    ----------
    xyz : (n, n, 3), X, Y, Z of equal cells of the directions' sines; a mirror's total has Y = 1.
    share : luminous power outside the mirror's lobe, as a share of all reflected light.
    """

    xyz: Real
    share: float

    def brightest(self) -> tuple[float, float, float]:
        """Return the largest luminous reflectance factor, and its direction θ, φ in degrees.

        Relative to a white Lambertian standard of the same place: π Y over the cell's area. 0 in
        the direction of the normal if no light is diffracted.
        """
        luminance = self.xyz[..., 1]
        row, column = np.unravel_index(np.argmax(luminance), luminance.shape)
        if not luminance[row, column] > 0.0:
            return 0.0, 0.0, 0.0
        x, y = ((n - 0.5 * len(luminance)) * _CELL for n in (column, row))
        theta = math.degrees(math.asin(min(math.hypot(x, y), 1.0)))
        phi = math.degrees(math.atan2(y, x))
        return float(luminance[row, column]) * math.pi / _CELL**2, theta, phi

    def iridescence(self) -> float:
        """Return the root mean square distance of the chromaticity u'v' from its mean.

        I = √(Σ Y |c − c̄|² / Σ Y) over the cells, with c = (u', v') of CIE 1976 (CIE 15:2018, 8.1)
        and c̄ = Σ Y c / Σ Y. 0 if no light is diffracted.
        """
        xyz = self._coloured()
        if not len(xyz):
            return 0.0
        chromaticity = _chromaticity(xyz)
        mean = np.average(chromaticity, axis=0, weights=xyz[:, 1])
        squares = np.sum(np.square(chromaticity - mean), axis=1)
        return float(np.sqrt(np.average(squares, weights=xyz[:, 1])))

    def hues(self) -> dict[str, float]:
        """Return the shares of the luminance by hue: they add up to 1, or are 0 without light.

        Hues are in linear sRGB, clipped to the display's gamut, in sextants of HSV around
        the primaries and their mixtures; "grey" has a saturation below `GREY`.
        """
        names, xyz = (*HUES, "grey"), self._coloured()
        if not len(xyz):
            return dict.fromkeys(names, 0.0)
        clipped = np.clip(linear_srgb(xyz), 0.0, None)
        hsv = rgb_to_hsv(clipped / np.maximum(clipped.max(axis=1, keepdims=True), 1e-300))
        sextant = np.floor(hsv[:, 0] * 6.0 + 0.5).astype(int) % 6
        sextant[hsv[:, 1] < GREY] = 6
        total = np.bincount(sextant, xyz[:, 1], minlength=7)
        return dict(zip(names, (total / total.sum()).tolist(), strict=True))

    def _coloured(self) -> Real:
        """Return X, Y, Z (m, 3) of the cells that have enough light for a colour."""
        luminance = self.xyz[..., 1]
        lit = luminance > _DARK * luminance.max(initial=0.0)
        return np.asarray(self.xyz[lit])


#: Factor of a material on the power of an order, and w = κ/k: functions of the sines (n, 2) of
#: directions and a wavelength, nm; see `MaterialFactor.at`.
Factor = Callable[[Real, float], tuple[Real, Real]]

# Polar angles, and azimuths from the light's, at which a material's factor is tabulated, degrees.
_POLAR, _AZIMUTHS = np.linspace(0.0, 90.0, 91), np.linspace(0.0, 180.0, 37)


@dataclass(frozen=True)
class MaterialFactor:
    """Factor of a material, layers and coat on the power of orders, for light of one polar angle.

    It belongs to the material alone: scans of one survey share it.

    Attributes
    ----------
    wavelengths : (n,), nm, those of the index.
    factor : (n, polar, azimuths) on the power.
    excess : (n, polar, azimuths), w less the sum of both cosines, which a coat changes.
    """

    wavelengths: Real
    factor: Real
    excess: Real

    @classmethod
    def of(cls, bsdf: Any, theta: float) -> MaterialFactor:
        """Tabulate the factor of a BSDF for light `theta` degrees from the normal.

        bsdf : `diffraction` of the current variant, spectral and vectorised. Its pigment does not
            diffract and is left out; so is the scale by which energy is conserved.
        """
        light = LightDirection(theta, 0.0)
        polar, azimuth = (np.radians(a) for a in np.meshgrid(_POLAR, _AZIMUTHS, indexing="ij"))
        cosine = np.maximum(np.cos(polar), 1e-4)
        sine = np.sqrt(1.0 - cosine**2)
        columns = sine * np.cos(azimuth), sine * np.sin(azimuth), cosine
        wo = vectors(np.stack([column.ravel() for column in columns], axis=-1))
        si = flat_interaction(mi.Vector3f(light.direction.tolist()), cosine.size)
        factors, excesses = [], []
        wavelengths = np.arange(SHORTEST + 0.5 * STEP, LONGEST, STEP)
        for wavelength in wavelengths:
            channel = mi.Float(float(wavelength))
            dr.make_opaque(channel)  # one kernel for all wavelengths
            si.wavelengths = mi.UnpolarizedSpectrum(channel)
            site = bsdf.site_at(si, mi.Mask(True))
            value, w = bsdf.material_factor(bsdf.pair(site, wo, mi.Mask(True)), site)
            shape = np.ones(cosine.size)
            factors.append((np.array(value[0], np.float64) * shape).reshape(cosine.shape))
            w = (np.array(w, np.float64) * shape).reshape(cosine.shape)
            excesses.append(w - cosine - light.direction[2])
        return cls(wavelengths, np.stack(factors), np.stack(excesses))

    def at(self, light: LightDirection) -> Factor:
        """Return the factor for light from a direction, whose polar angle is the table's."""

        def factor(sines: Real, wavelength: float) -> tuple[Real, Real]:
            n = int(np.argmin(np.abs(self.wavelengths - wavelength)))
            radius = np.minimum(np.hypot(*sines.T), 1.0)
            turn = np.arctan2(sines[:, 1], sines[:, 0]) - math.radians(light.phi)
            turn = np.abs((turn + math.pi) % (2.0 * math.pi) - math.pi)
            place = (
                np.degrees(np.arcsin(radius)) / _POLAR[1],
                np.degrees(turn) / _AZIMUTHS[1],
            )
            value, excess = (
                map_coordinates(field[n], place, order=1, mode="nearest")
                for field in (self.factor, self.excess)
            )
            return value, light.direction[2] + np.sqrt(1.0 - radius**2) + excess

        return factor


def light_and_chance(
    table: DiffractionTable, light: LightDirection, factor: Factor
) -> tuple[DiffractedLight, float]:
    """Return the diffracted light, and the part of its index that chance explains.

    Chance is an unordered surface of the same size and roughness, the mean over `CHANCES`: each
    order has the median power of all orders at its frequency, times a random factor as of speckle,
    exponentially distributed. The index is a root mean square over the light, so that chance has a
    part in it by its share of the luminance: a grating's lobes are above the median and have none.

    factor : of the surface's material (`MaterialFactor.at`).
    """
    last = table.grid.last
    shape = (2 * last[1] + 1, 2 * last[0] + 1)
    speckles = [
        np.random.default_rng(seed).exponential(1.0 / math.log(2.0), shape)
        for seed in range(CHANCES)
    ]
    own, *unordered = diffracted_light(table, light, factor, speckles)
    chance = float(np.mean([each.iridescence() for each in unordered]))
    total = float(own.xyz[..., 1].sum())
    share = float(np.mean([each.xyz[..., 1].sum() for each in unordered])) / max(total, 1e-300)
    return own, chance * math.sqrt(min(share, 1.0))


def diffracted_light(
    table: DiffractionTable,
    light: LightDirection,
    factor: Factor,
    speckles: Sequence[Real] = (),
) -> list[DiffractedLight]:
    """Collect the orders of a table by direction, in daylight (D65).

    An order of power P leaves in the direction sinθo = λq/2π − sinθi. It is seen through a
    coherence window of `WINDOW`, or the table's if that is narrower. Orders of periods as long as
    the window and longer, order 0 among them, are the mirror's lobe and left out. Powers follow
    Kirchhoff's integral (equations 3 and 4 of docs/theory.md), before energy is conserved.

    Returns the table's light, and the light of each unordered surface of `speckles`.

    Raises a DiffractionError if the table lacks orders, or wavelengths from 380 nm on.

    Parameters
    ----------
    table : all orders, of any coherence; one of `patch` counts as the mean of all windows.
    factor : of the surface's material (`MaterialFactor.at`).
    speckles : factors (2 ny + 1, 2 nx + 1) on the median power of all orders at a frequency, in
        place of the powers.
    """
    if table.wavelength_range[0] > SHORTEST:
        raise DiffractionError(
            f"iridescence requires a table from {SHORTEST:g} nm on, and this table starts at "
            f"{table.wavelength_range[0]:g} nm; build it with a wider wavelength_range"
        )
    table.require_whole("a list of powers is made of")
    stored = as_powers(table.averaged)
    expansion, coefficients = stored.expansion, stored.coefficients[:, :, :, 0].astype(np.float32)
    width = min(WINDOW, table.window_width)
    # the orders of a scan have its taper's lobes already
    sigma = (sigma_of(width) ** -2 - table.inverse_taper) ** -0.5
    kappas = np.arange(_NODES + 1) * (expansion.kappa_max / _NODES)
    factors = (expansion.weights(kappas) / stored.scale).astype(np.float32)
    intervals = expansion.interval(kappas)
    qx, qy = (
        spacing * np.arange(-last, last + 1)
        for spacing, last in zip(table.spacing, table.grid.last, strict=True)
    )
    frequency = np.hypot(qx, qy[:, None])
    # 1e-6: rounding decides about orders of exactly that period otherwise
    mirror = frequency < (1.0 + 1e-6) * 2.0 * math.pi / width
    rings = np.round(frequency / min(table.spacing)).astype(int)
    count = 2 * math.ceil(1.15 / _CELL)
    wavelengths = np.arange(SHORTEST + 0.5 * STEP, LONGEST, STEP)
    responses = np.array([response(wavelength) for wavelength in wavelengths]) * STEP
    beside = np.empty((len(wavelengths), 1 + len(speckles), count, count), np.float32)
    central = np.empty((len(wavelengths), 1 + len(speckles)))
    for n, wavelength in enumerate(wavelengths):
        k = float(wavenumber(wavelength))
        x, y = qx / k - light.direction[0], qy / k - light.direction[1]
        z2 = 1.0 - x**2 - y[:, None] ** 2
        rows, columns = np.nonzero(z2 > 0.0)
        sines = np.stack([x[columns], y[rows]], axis=-1)
        cosine = np.sqrt(z2[rows, columns])
        reflected, w = factor(sines, float(wavelength))
        r_0, w_0 = factor(light.mirror[None, :2], float(wavelength))
        node = np.minimum(np.round(k * w * (_NODES / expansion.kappa_max)).astype(int), _NODES)
        terms = coefficients[intervals[node], rows, columns]
        power = np.einsum("nt,nt->n", terms, factors[node]).astype(np.float64)
        powers = [power]
        if speckles:
            ring = rings[rows, columns]
            medians = median(power, ring, np.arange(rings.max() + 1))
            unordered = np.maximum(np.nan_to_num(medians), 0.0)[ring]
            powers += [unordered * speckle[rows, columns] for speckle in speckles]
        reflected = reflected * _obliquity(sines, cosine, light)
        near = mirror[rows, columns]
        order_0 = float(r_0[0] * order_0_power(table.averaged, k * w_0)[0])
        lobe = 1.0 / (math.sqrt(2.0) * k * sigma)  # standard deviation of its power
        sent = np.stack(powers) * reflected
        central[n] = sent[:, near].sum(axis=1) + order_0
        _spread(sines[~near], sent[:, ~near], lobe, beside[n])
    xyz = np.moveaxis(np.tensordot(responses.astype(np.float32), beside, (0, 0)), 0, -1)
    diffracted = xyz[..., 1].sum(axis=(1, 2), dtype=np.float64)
    shares = diffracted / np.maximum(diffracted + responses[:, 1] @ central, 1e-300)
    return [DiffractedLight(*both) for both in zip(xyz, shares.tolist(), strict=True)]


def _obliquity(sines: Real, cosine: Real, light: LightDirection) -> Real:
    """Return the power of an order over |a_j|²: ((1 + ωi·ωo)/w)² / (cosθi cosθo) (n,).

    The integral of equation 4 of docs/theory.md over the lobe, R = 1; 1 in the mirror direction.
    """
    cos_i = light.direction[2]
    total = sines + light.direction[:2]
    w = cosine + cos_i
    dot = 0.5 * (np.sum(total**2, axis=1) + w**2)
    return np.asarray((dot / w) ** 2 / (cos_i * cosine))


def _spread(sines: Real, powers: Real, lobe: float, out: NDArray[np.float32]) -> None:
    """Distribute powers (m, n) at sines (n, 2) over cells (m, count, count), with their lobes."""
    count = out.shape[-1]
    position = sines / _CELL + 0.5 * count
    nearest = np.round(position).astype(int)
    part = position - nearest
    # quadratic B-splines, whose variance is 1/4 wherever the position lies between cells
    weights = 0.5 * (0.5 - part) ** 2, 0.75 - part**2, 0.5 * (0.5 + part) ** 2
    three = np.arange(-1, 2)
    rows, columns = (nearest[:, axis] + three[:, None] for axis in (1, 0))
    across, along = (np.stack([each[:, axis] for each in weights]) for axis in (1, 0))
    index = (rows[:, None] * count + columns).ravel()
    share = (across[:, None] * along).reshape(9, -1)
    deviation = math.sqrt((lobe / _CELL) ** 2 - 0.25)
    for power, field in zip(powers, out, strict=True):
        cells = np.bincount(index, (share * power).ravel(), minlength=count * count)
        gaussian_filter(cells.reshape(count, count), deviation, output=field, mode="constant")
        # sharpened powers of a scan dip below 0 between strong orders, as look-ups do
        np.maximum(field, 0.0, out=field)


def _chromaticity(xyz: Real) -> Real:
    """Return u', v' of CIE 1976: 4X and 9Y over X + 15Y + 3Z."""
    weights = np.array([1.0, 15.0, 3.0])
    total = np.maximum(xyz @ weights, 1e-300)
    return np.stack([4.0 * xyz[:, 0] / total, 9.0 * xyz[:, 1] / total], axis=-1)
