"""Tables of the thesis' methods as textures."""

from __future__ import annotations

import numpy as np

from ...errors import DiffractionError
from ...heights import HeightField
from ...realtime.glsl.packing import area_factor
from ...realtime.glsl.texels import Packed, as_half, listed, texels
from ...tables import DiffractionTable
from ..methods import FullSpectrum, OrdersOnly, Repeated, make
from ..methods.method import SPECULAR_WAVELENGTH, Method

#: Values of the thesis: terms of the series, bins read along each axis, wavelength step in nm.
TERMS, TAPS, STEP = 37, 3, 5.0
#: Error of 37 terms and 3 × 3 bins on snakes' scales; the thesis has no tolerance.
TOLERANCE = 0.02


def thesis_method(name: str, heights: HeightField, table: DiffractionTable) -> Method:
    """Build a method of the thesis for a patch, with the thesis' settings.

    table : table of the patch, whose window and coherence the method uses for all orders.

    Raises a DiffractionError if the series is too short for the patch, or the method needs a period
    and the patch has none.
    """
    settings = {} if name == "pq" else {"taps": TAPS}  # pq reads two bins along each axis
    return make(
        name, heights, coherence_width=table.window_width, coherence=table.coherence,
        terms=TERMS, tolerance=TOLERANCE, step=STEP, **settings,
    )  # fmt: skip


def pack_method(method: Method) -> Packed:
    """Pack the Taylor table and settings of a method.

    Raises a DiffractionError if no shader implements the method, or its table has no Taylor series.
    """
    if isinstance(method, OrdersOnly):
        periods = tuple(0.0 if period is None else period for period in method.periods)
        return pack_method(method.full) | Packed(
            uniforms={
                "periods": periods,
                "specular_reach": method.specular,
                "white_wavelength": SPECULAR_WAVELENGTH * 1e-3,
            }
        )
    if not isinstance(method, FullSpectrum | Repeated):
        raise DiffractionError(f"method '{method.name}' has no shader")
    table = method.table
    if table.expansion.basis != "taylor":
        raise DiffractionError(f"method '{method.name}' needs a table with basis='taylor'")
    terms = table.expansion.terms
    definitions = {"TEXELS": str(-(-terms // 2))}
    repeats, taps = (1.0, 1.0), table.grid.taps
    if isinstance(method, Repeated):
        definitions["REPEATED"] = ""
        repeats, taps = (float(method.repeats[0]), float(method.repeats[1])), (2, 2)
    definitions |= {"TAPS_X": str(taps[0]), "TAPS_Y": str(taps[1])}
    if table.grid.coherent:
        definitions["COHERENT"] = ""
    # real and imaginary part of a term are adjacent; a texel has two terms
    series = np.moveaxis(table.coefficients[0], 2, 3)
    series = series.reshape(-1, 2 * terms)
    zero = table.order_0[0].T.reshape(1, -1).astype(np.float32)
    steps = np.diff(method.wavelengths)
    return Packed(
        textures=(
            listed("series_amplitudes", as_half(texels(series))),
            listed("amplitude_zero", texels(zero)),
        ),
        uniforms={
            "last_order": (table.grid.last[0], table.grid.last[1]),
            "spacing": (table.spacing[0], table.spacing[1]),
            "exponents": (table.grid.exponents[0], table.grid.exponents[1]),
            "half_range": table.expansion.half_range,
            "inverse_scale": 1.0 / table.scale,
            "first_wavelength": float(method.wavelengths[0]) * 1e-3,
            "last_wavelength": float(method.wavelengths[-1]) * 1e-3,
            "wavelength_step": float(steps.max()) * 1e-3,
            "repeats": repeats,
            "area_factor": area_factor(method.sigma),
        },
        definitions=definitions,
    )  # fmt: skip
