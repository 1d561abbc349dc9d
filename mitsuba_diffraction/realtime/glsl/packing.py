"""Packing of tables as textures for the methods `fast` and `exact` (NumPy only)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ...arrays import Real
from ...errors import DiffractionError
from ...optics.blend import NODES_PER_OCTAVE, RoughnessTable
from ...optics.boundary import Model
from ...optics.colour import (
    RGB_WAVELENGTHS,
    daylight_shares,
    linear_srgb,
    metal_tint,
    response,
)
from ...optics.fresnel import reflectance
from ...optics.geometry import wavenumber
from ...shading.powers import pack_powers as pack_orders
from ...tables import DiffractionTable
from ...tables.colour.build import VISIBLE
from ...tables.colour.table import ColourTable
from ...tables.directional import FINE, SHARE, DirectionalTable
from .texels import Packed, Texture, as_half, four_channels, listed, paired

#: First and last wavenumber of the loops over wavelengths, rad/µm.
WAVENUMBERS = (2e3 * math.pi / VISIBLE[1], 2e3 * math.pi / VISIBLE[0])

_LAM = np.arange(360.0, 830.5, 1.0)  # nm
_HALVES = 6e4  # half floats end at 65504
_RESPONSES = 2048  # nodes over k, about 0.4 nm apart
_ANGLES, _WAVELENGTHS = 129, 64  # nodes of a conductor's reflectance


def pack_colours(table: ColourTable) -> Packed:
    """Pack a colour table for `fast`."""
    grid = table.grid
    starts = np.array([grid.start(n) for n in range(grid.rings)])
    counts = np.array(grid.counts)
    # floats are exact up to 2²⁴: larger tables exceed the textures
    rings = np.stack([starts[:-1], counts[:-1], counts[1:], counts[1:]], axis=1)
    glossy = four_channels(table.order_0[..., :3].astype(np.float32))
    brightest = max(float(np.abs(glossy).max()), 1e-30)
    return Packed(
        textures=(
            listed("colours", paired(table.coefficients).reshape(-1, 4)),
            listed("rings", rings.astype(np.float32)),
            Texture("glossy", (glossy * (_HALVES / brightest)).astype(np.float16)),
        ),
        uniforms={
            "bins": grid.bins,
            "last_ring": grid.rings - 1,
            "smallest_radius": grid.smallest,
            "ring_step": grid.step,
            "interval_length": table.expansion.length,
            "intervals": table.expansion.intervals,
            "inverse_scale": 1.0 / table.scale,
            "glossy_ends": (table.z_max, table.radius_end),
            "glossy_scale": brightest / _HALVES,
            "area_factor": area_factor(table.sigma),
            "sigma_0": table.sigma_0,
            "channel_wavenumbers": tuple(wavenumber(RGB_WAVELENGTHS).tolist()),
        },
        definitions={"ORDER_0": ""}
        | ({"COHERENT": ""} if table.expansion.kind == "amplitude" else {}),
    )


def pack_powers(table: DiffractionTable) -> Packed:
    """Pack a table's powers for `exact`; amplitudes are converted to powers.

    Raises a DiffractionError for a coherent table (`coherence="patch"`), whose orders interfere.
    """
    if table.grid.coherent:
        raise DiffractionError(
            "method exact adds powers, but the table has coherence='patch', where amplitudes "
            "interfere; use method fast"
        )
    powers = pack_orders(table)
    expansion = powers.expansion
    return Packed(
        textures=(
            listed("orders", as_half(powers.orders.reshape(-1, 4))),
            listed("functions", powers.factors.reshape(-1, 4)),
        ),
        uniforms={
            "last_order": (table.grid.last[0], table.grid.last[1]),
            "spacing": (table.spacing[0], table.spacing[1]),
            "sigma": table.sigma,
            "order_0_ratio": table.order_0_ratio,
            "inverse_taper": table.inverse_taper,
            "interval_length": expansion.length,
            "intervals": expansion.intervals,
            "cells": powers.cells,
            "inverse_scale": 1.0 / powers.scale,
            "area_factor": area_factor(table.sigma),
        },
        definitions={"TEXELS": str(powers.texels), "ORDER_0": ""},
    )


def area_factor(sigma: float) -> float:
    """Return 4π²σ⁴ over the window's area πσ², µm²."""
    return 4.0 * math.pi * sigma**2


def pack_directions(
    excesses: Sequence[DirectionalTable | None], scales: Sequence[NDArray[np.float32] | None]
) -> Packed:
    """Pack what depends on one direction, one page per height scale; empty without any.

    excesses : albedo less the flat interface's reflectance (`Surface.albedo_excess`), which
        light has that reaches the base beneath; None without a base.
    scales : s on a grid of directions, (polar + 1, azimuthal) each, which conserve energy
        (`Surface.energy_scale`); None for 1.
    """
    given = {"BENEATH": excesses, "ENERGY_CONSERVING": scales}
    definitions = {name: "" for name, pages in given.items() if any(p is not None for p in pages)}
    if not definitions:
        return Packed()
    values = np.zeros((len(scales), *FINE.ones.shape, 4), np.float16)
    for page, excess, scale in zip(values, excesses, scales, strict=True):
        if excess is not None:
            shares = daylight_shares(excess.wavelengths)
            page[..., :3] = np.tensordot(excess.on(FINE).values, shares, (0, 0))
        if scale is not None:
            page[..., 3] = scale - 1.0  # half floats are finer near 0
    definitions |= {
        "GRID_PAGES": str(len(values)),
        "GRID_POLAR": str(FINE.polar),
        "GRID_AZIMUTHAL": str(FINE.azimuthal),
        "GRID_SHARE": repr(float(SHARE)),
    }
    texture = Texture("directions", values.reshape(-1, *values.shape[2:]), smooth=True)
    return Packed((texture,), {"energy_page": 0.0}, definitions)


def colour_weights(wavelengths: Real, relative: Real | float = 1.0) -> Real:
    """Return the matrix (n, 3) from values over wavelengths in nm to linear sRGB under daylight.

    relative : spectrum (n,) of another light, relative to daylight.
    """
    weights = (daylight_shares(wavelengths).T * relative).T
    return np.asarray(weights / weights.sum(axis=0))


def pack_responses(lights: Sequence[tuple[Real, Real]]) -> Packed:
    """Pack the contribution of each light's wavelengths to linear sRGB, for `exact`.

    lights : wavelengths (n,) in nm of each light, and its spectrum relative to D65 of luminance 1,
        (n,), or (n, 3) in RGB variants. An empty list is packed as one dark light.
    """
    lights = lights or [(np.array([360.0, 830.0]), np.zeros(2))]
    k = np.linspace(*WAVENUMBERS, _RESPONSES)
    lam = 2e3 * np.pi / k
    # per nm to per µm; the loop's variable is k, and s̄/λ² dλ = s̄/2π dk
    daylight = linear_srgb(response(lam)) * (1e3 / (2.0 * np.pi))
    rows = np.zeros((len(lights), _RESPONSES, 4), np.float32)
    for row, (wavelengths, spectrum) in zip(rows, lights, strict=True):
        values = np.stack([np.interp(lam, wavelengths, s) for s in np.atleast_2d(spectrum.T)], 1)
        row[1:-1, :3] = (daylight * values)[1:-1]  # the ends are 0: invisible wavelengths
    return Packed((Texture("responses", rows),), {"wavenumbers": WAVENUMBERS})


def daylight_colour(wavelengths: Real, spectrum: Real) -> Real:
    """Return linear sRGB (3,) of a spectrum relative to D65, as in `pack_responses`."""
    return np.asarray((daylight_shares(wavelengths).T * spectrum.T).sum(axis=1))


def pack_conductor(wavelengths: Real, eta: Real, k: Real) -> Packed:
    """Pack a conductor's reflectance by angle and wavelength, and in linear sRGB under daylight.

    wavelengths : (n,) nm.
    eta, k : (n,), the complex index of refraction η + ik.
    """
    cosines = np.linspace(0.0, 1.0, _ANGLES)
    waves = np.linspace(*WAVENUMBERS, _WAVELENGTHS)
    lam = 2e3 * np.pi / waves

    def reflectances(nm: Real) -> Real:
        """Return the reflectance (n, angles) at wavelengths (n,)."""
        index = np.interp(nm, wavelengths, eta) + 1j * np.interp(nm, wavelengths, k)
        return reflectance(cosines, index[:, None])

    rows = np.zeros((_WAVELENGTHS + 1, _ANGLES, 4), np.float32)
    rows[:-1, :, 0] = reflectances(lam)
    rows[:-1, :, 1] = np.interp(lam, wavelengths, eta)[:, None]
    rows[:-1, :, 2] = np.interp(lam, wavelengths, k)[:, None]
    fine = reflectances(_LAM)
    rows[-1, :, :3] = fine.T @ daylight_shares(_LAM)
    tint = metal_tint(_LAM, fine[:, -1], rows[-1, -1, :3])
    return Packed(
        (Texture("reflectances", rows),),
        {
            "wavenumbers": WAVENUMBERS,
            "channel_eta": tuple(np.interp(RGB_WAVELENGTHS, wavelengths, eta).tolist()),
            "channel_k": tuple(np.interp(RGB_WAVELENGTHS, wavelengths, k).tolist()),
            **{f"tint_{n}": tuple(column) for n, column in enumerate(tint.T.tolist())},
        },
        {"SURFACE_KIND": "2"},
    )


def pack_boundary(model: Model, roughness: RoughnessTable) -> Packed:
    """Pack a boundary model with its statistic of the heights.

    roughness : σ_q² of the surface.
    """
    name = {"BOUNDARY": model.name}
    if model.statistic is None:
        return Packed((), {}, name)
    statistic = model.statistic(roughness)
    nodes = statistic.nodes.astype(np.float32)
    return Packed(
        (Texture("statistic", nodes[None, :, None]),),
        {
            "first_octave": statistic.first,
            "channel_wavenumbers": tuple(wavenumber(RGB_WAVELENGTHS).tolist()),
        },
        {**name, "STATISTIC": "", "NODES_PER_OCTAVE": f"{NODES_PER_OCTAVE}.0"},
    )
