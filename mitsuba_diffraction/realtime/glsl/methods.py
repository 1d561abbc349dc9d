"""Tables of each method as textures, and its program for each surface of a scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import DiffractionError, check_choice
from ...heights.field import HeightField
from ...plugin.description import Consumer, Feature
from ...settings import TableSettings
from ...tables.build.build import build_with
from ...tables.source import cached_table
from ...tables.table import DiffractionTable
from ...thesis.methods import FullSpectrum, OrdersOnly, Repeated, make
from ...thesis.methods.method import SPECULAR_WAVELENGTH, Method
from .context import Bindings, compile_program
from .packing import area_factor
from .scene import VERTEX
from .shader_materials import GLSL, Diffracting
from .source import METHODS, THESIS_METHODS
from .texels import Packed, as_half, listed, texels

_REMEDY = "use method fast"
#: Methods that draw less than `fast`.
CONSUMERS = {
    "exact": Consumer("method exact", GLSL.shows - {Feature.PATCH}, _REMEDY),
    **{
        name: Consumer(f"method {name} of the thesis", GLSL.shows - {Feature.ORDERS}, _REMEDY)
        for name in THESIS_METHODS
    },
}

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
    check_choice("method", name, THESIS_METHODS)
    settings = {} if name == "pq" else {"taps": TAPS}  # pq reads two bins along each axis
    return make(
        name, heights, coherence_width=table.window_width, coherence=table.coherence,
        terms=TERMS, tolerance=TOLERANCE, step=STEP, build=_cached_build, **settings,
    )  # fmt: skip


def _cached_build(heights: HeightField, **arguments: Any) -> DiffractionTable:
    """Build a table like `DiffractionTable.build`, or read it from the cache."""
    progress = arguments.pop("progress", None)
    settings = TableSettings(**arguments)
    return cached_table(
        heights.digest(), settings, lambda: build_with(heights, settings, progress), [heights.name]
    )


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


class Prepared:
    """Programs and tables of one method for all surfaces of a scene.

    tables : tables of the method.
    surfaces : bindings of each surface, without the method's tables; `numbers` of its table.

    Raises a DiffractionError if the method is unknown, or does not support a table.
    """

    def __init__(
        self,
        context: Any,
        method: str,
        tables: Sequence[Packed],
        numbers: Sequence[int | None],
        surfaces: Sequence[Bindings],
        buffers: Sequence[Any],
    ) -> None:
        self._context, self._method = context, method
        self._surfaces, self._buffers = surfaces, buffers
        self.nbytes = sum(packed.nbytes for packed in tables)  # size of the method's textures
        bound = [Bindings(context, packed) for packed in (*tables, Packed())]
        # one for each surface, the last without a table
        self.tables = [bound[-1 if number is None else number] for number in numbers]
        self._programs: dict[object, Any] = {}
        self._arrays: dict[object, Any] = {}

    def part(self, number: int, *further: Mapping[str, str]) -> tuple[Any, Any]:
        """Return the program of a surface and its vertex array; both are cached.

        further : definitions of the light and its surroundings.

        Raises a DiffractionError if the program does not compile.
        """
        definitions = {**self._surfaces[number].definitions, **self.tables[number].definitions}
        for more in further:
            definitions |= more
        key = frozenset(definitions.items())
        if key not in self._programs:
            self._programs[key] = compile_program(self._context, self._method, definitions)
        program = self._programs[key]
        if (number, key) not in self._arrays:
            array = vertex_array(self._context, program, self._buffers[number])
            self._arrays[number, key] = array
        return program, self._arrays[number, key]

    def release(self) -> None:
        for held in (self._arrays, {id(t): t for t in self.tables}, self._programs):
            for thing in held.values():
                thing.release()


def method_tables(method: str, surface: Diffracting) -> Packed:
    """Pack a surface's table for a method.

    Raises a DiffractionError if the method is unknown, or does not support the table.
    """
    check_choice("method", method, METHODS)
    described = surface.described
    if method in CONSUMERS:
        CONSUMERS[method].check(described)
    if method in THESIS_METHODS and described.heights is not None:
        return pack_method(thesis_method(method, described.heights(), described.patch))
    return surface.tables(method)


def vertex_array(context: Any, program: Any, buffer: Any) -> Any:
    """Return the vertex array of the attributes that a program reads."""
    names = [name for name, _ in VERTEX if name in program]
    layout = " ".join(f"{n}f" if name in program else f"{4 * n}x" for name, n in VERTEX)
    return context.vertex_array(program, [(buffer, layout, *names)])
