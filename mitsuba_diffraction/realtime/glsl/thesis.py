"""The methods of the 2014 thesis as textures, from their evaluators in `thesis.methods`."""

from __future__ import annotations

from typing import Any

import numpy as np

from ...errors import DiffractionError
from ...heights.field import HeightField
from ...settings import TableSettings
from ...tables.build.build import build_with
from ...tables.store import cached_table
from ...tables.table import DiffractionTable
from ...thesis.methods import FullSpectrum, OrdersOnly, Repeated, make
from ...thesis.methods.method import Method
from ...thesis.methods.periodic import SPECULAR_WAVELENGTH
from .packing import area_factor
from .source import THESIS_METHODS
from .texels import Packed, as_half, listed, texels

#: As in the thesis: terms of the series, bins read along each axis, and nm.
TERMS, TAPS, STEP = 37, 3, 5.0
#: What 37 terms and 3 × 3 bins reach on snakes' scales; the thesis asks for none.
TOLERANCE = 0.02


def thesis_method(name: str, heights: HeightField, table: DiffractionTable) -> Method:
    """A method of the thesis for a patch, with the thesis' own settings.

    Parameters
    ----------
    name : one of `source.THESIS_METHODS`.
    heights : the patch.
    table : the package's own of that patch, for its window and how positions are averaged.

    Raises
    ------
    DiffractionError
        If the series is too short for the patch, or it has no period and the method needs one.
    """
    if name not in THESIS_METHODS:
        raise DiffractionError(f"method='{name}' is none of {', '.join(THESIS_METHODS)}")
    settings = {} if name == "pq" else {"taps": TAPS}  # pq reads two bins along each axis
    return make(
        name, heights, coherence_width=table.coherence_width, coherence=table.coherence,
        terms=TERMS, tolerance=TOLERANCE, step=STEP, build=_kept, **settings,
    )  # fmt: skip


def _kept(heights: HeightField, **arguments: Any) -> DiffractionTable:
    """`DiffractionTable.build`, once for a patch and its arguments."""
    progress = arguments.pop("progress", None)
    settings = TableSettings(**arguments)
    return cached_table(heights.digest(), settings, lambda: build_with(heights, settings, progress))


def pack_method(method: Method) -> Packed:
    """A method's Taylor table and settings.

    Raises
    ------
    DiffractionError
        If there is no shader for the method, or its table is no Taylor series.
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
    # real and imaginary part of a term side by side, two terms a texel
    series = np.moveaxis(table.coefficients[0], 2, 3)
    series = series.reshape(-1, 2 * terms)
    zero = table.order_0[0].T.reshape(1, -1).astype(np.float32)
    steps = np.diff(method.wavelengths)
    return Packed(
        textures=(
            listed("amplitudes", as_half(texels(series))),
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
