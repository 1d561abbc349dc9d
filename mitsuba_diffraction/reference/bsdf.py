"""BRDF and Mueller matrices of a surface, computed from its heights for every pair of directions.

The default is `model.default_brdf`; other models, windows, coats and films replace one factor of
its equation (4).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from ..arrays import Complex, Real
from ..errors import DiffractionError
from ..heights import HeightField
from ..optics.blend import ScaleRoughness
from ..optics.boundary import Heights, geometry
from ..optics.boundary import model_of as registered_model
from ..optics.fresnel import Filmed
from ..optics.geometry import wavenumber
from ..settings import COHERENCES
from . import boundary
from . import coat as coats
from . import model as models
from .arguments import Window, directions_of, index_of, model_of, window_of
from .integral import window_powers
from .mirror import interfering
from .model import Light

#: A measure of Jones matrices (n, 2, 2): N of unpolarised light (n,), or Mueller matrices.
Measure = Callable[[Complex], Real]


def brdf(
    field: HeightField,
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    *,
    coherence_width: str | float = "auto",
    coherence: str = "ensemble",
    place: ArrayLike | None = None,
    model: str | None = None,
    eta: ArrayLike | None = None,
    k: ArrayLike = 0.0,
    coat: float | None = None,
    film: tuple[complex, float] | None = None,
) -> Real:
    """BRDF of a surface with these heights for unpolarised light, in 1/sr, shape (n,).

    Equations (1) to (9) of `reference.model`; defaults as in the BSDF `diffraction`.
    Below the surface the BRDF is 0.

    Raises a DiffractionError for an unknown coherence or model, a width that is not positive and
    finite, an index or a place that is missing or superfluous, or arrays whose shapes do not fit.

    Parameters
    ----------
    field : HeightField, heights in µm.
    wi, wo : (n, 3) or (3,), unit vectors in the patch's frame, pointing away from the surface;
        x runs along rows, y along columns, z is the normal.
    wavelength : (n,) or scalar, vacuum wavelength in nm.
    coherence_width : µm over which the light is coherent, 4σ₀; "auto" is 65 µm. The window of all
        orders but 0 is at most as wide as a patch that does not repeat (`heights.coherence`).
    coherence : "ensemble", the power averaged over every position of the window; "patch", the
        power under one window centred on the patch; "surface", under one centred on `place`.
    place : (n, 2) or (2,), µm along x and y from the patch's first pixel; it tiles the plane.
    model : "small_slope", the default where there is an index, "kirchhoff", or another of
        `optics.boundary.MODELS`.
    eta, k : (n,) or scalar, the index eta + ik of the material relative to the medium above it;
        without eta the surface is a perfect reflector, R = 1, by model "kirchhoff".
    coat : index of a flat clear coat over the surface, relative to the medium above
        (`optics.coat`); it needs eta, and its own reflection is the lobe of a flat patch.
    film : index n + ik, relative to the medium above, and thickness in nm of a film that follows
        the heights, coherent with the surface (`optics.fresnel.Filmed`); it needs eta, and no coat.
    """
    light = directions_of(wi, wo, wavelength)
    window = window_of(coherence_width, field, coherence, place, len(light.wavelength))
    index = index_of(eta, k, light.wavelength, film)
    name = model_of(model, index, coat=coat)
    if index is None:
        index = np.full(len(light.wavelength), np.inf, complex)
    return _reflected(boundary.unpolarised, field, light, window, name, index, coat)


def mueller(
    field: HeightField,
    wi: ArrayLike,
    wo: ArrayLike,
    wavelength: ArrayLike,
    *,
    eta: ArrayLike,
    k: ArrayLike = 0.0,
    coherence_width: str | float = "auto",
    coherence: str = "ensemble",
    place: ArrayLike | None = None,
    model: str | None = None,
    coat: float | None = None,
    film: tuple[complex, float] | None = None,
) -> Real:
    """Mueller matrices of the BRDF, in 1/sr, shape (n, 4, 4); arguments and errors as `brdf`.

    They take Stokes vectors of light along −ωi to Stokes vectors of light along ωo, both about the
    axes of `reference.boundary.polarisation_axes`. Entry (0, 0) is `brdf`.
    """
    light = directions_of(wi, wo, wavelength)
    window = window_of(coherence_width, field, coherence, place, len(light.wavelength))
    index = index_of(eta, k, light.wavelength, film)
    name = model_of(model, index, coat=coat)
    if index is None:
        raise DiffractionError("polarisation needs an index: give eta (and k of a conductor)")
    return _reflected(boundary.mueller, field, light, window, name, index, coat)


def _reflected(
    measure: Measure,
    field: HeightField,
    light: Light,
    window: Window,
    name: str,
    index: Complex | Filmed,
    coat: float | None,
) -> Real:
    """Measured light where both directions are above the surface, 0 elsewhere."""
    lit = (light.wi[:, 2] > 0) & (light.wo[:, 2] > 0)
    values = measure(np.zeros((len(lit), 2, 2), complex))
    if not lit.any():
        return values
    light, window, index = Light(*(part[lit] for part in light)), window.at(lit), index[lit]
    averaged = window.coherence == COHERENCES[0]
    if coat is not None:
        assert not isinstance(index, Filmed)
        inside, relative = coats.refracted_light(light, coat), index / coat
        jones = _matrices(field, inside, relative, name)
        powers = window_powers(field, *inside, *window)
        values[lit] = coats.reflected(light, window.sigmas, coat, relative, powers, jones, measure)
    elif name == "small_slope" and averaged and not isinstance(index, Filmed):
        values[lit] = models.default_brdf(field, light, index, window.sigmas, measure)
    else:
        jones = _matrices(field, light, index, name)
        others, zeroth, cosine = window_powers(field, *light, *window)
        rest = models.reflected(light, window.sigmas.orders, others, jones, measure)
        mirror = models.mirrored(light, window.sigmas, zeroth, index, measure)
        values[lit] = interfering(rest, mirror, cosine)
    return values


def _matrices(field: HeightField, light: Light, index: Complex | Filmed, name: str) -> Complex:
    """J of the heights, in the medium where `light` and `index` are given."""
    if name == "kirchhoff":
        return models.kirchhoff(light.wi, light.wo, index)
    if name == "small_slope":
        return models.blended(light.wi, light.wo, index, models.share(field, light, index))
    # a registered model by its own formula, for heights without a table
    model = registered_model(name)
    (x0, y0, z0), (x, y, z) = light.wi.T, light.wo.T
    heights = None
    if model.statistic is not None:
        k = wavenumber(light.wavelength)
        q = k * np.hypot(x0 + x, y0 + y)
        exact = ScaleRoughness.from_heights(field.heights, field.pixel_size)
        heights = Heights(k * (z0 + z), model.statistic(exact.table(float(q.max()))).at(q))
    entries = model.jones(geometry((x0, y0, z0), (x, y, z)), index, heights)
    ss, sp, ps, pp = (entry / (2 * z0 * z) for entry in entries)
    return boundary.jones_matrix(ss=ss, sp=sp, ps=ps, pp=pp)
