"""What a method needs to draw a scene: its tables as textures, and a program for each surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from ...errors import DiffractionError
from ...heights.field import HeightField
from ...optics.geometry import sigma_of
from ...settings import TableSettings
from ...tables.build.build import build_with
from ...tables.store import cached_colours, cached_table
from ...tables.table import DiffractionTable
from ...thesis.methods import FullSpectrum, OrdersOnly, Repeated, make
from ...thesis.methods.method import SPECULAR_WAVELENGTH, Method
from .context import Bindings, compile_program
from .materials import Material
from .packing import area_factor, pack_colours, pack_powers
from .scene import VERTEX, RealtimeScene
from .source import METHODS, THESIS_METHODS
from .texels import Packed, Uniform, as_half, listed, texels

#: As in the thesis: terms of the series, bins read along each axis, and nm.
TERMS, TAPS, STEP = 37, 3, 5.0
#: What 37 terms and 3 × 3 bins reach on snakes' scales; the thesis asks for none.
TOLERANCE = 0.02


def thesis_method(name: str, heights: HeightField, table: DiffractionTable) -> Method:
    """A method of the thesis for a patch, with the thesis' own settings.

    table : the package's own of that patch, for its window and how positions are averaged.

    Raises a DiffractionError if the series is too short for the patch, or it has no period and the
    method needs one.
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

    Raises a DiffractionError if there is no shader for the method, or its table is no Taylor
    series.
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


class Part(NamedTuple):
    """One surface's program, its vertices in it, and its tables."""

    program: Any
    array: Any
    tables: Bindings


class Prepared:
    """Programs and tables of one method for all surfaces of a scene.

    surfaces : what each surface's shader reads but for the method's tables.

    Raises a DiffractionError if there is no such method, or a table does not suit it.
    """

    def __init__(
        self,
        context: Any,
        scene: RealtimeScene,
        method: str,
        surfaces: Sequence[Bindings],
        buffers: Sequence[Any],
    ) -> None:
        self._context, self._method = context, method
        self._surfaces, self._buffers = surfaces, buffers
        packed: dict[int, Packed] = {}
        for surface in scene.diffracting:
            key = id(surface.material.table)
            if key not in packed:
                packed[key] = method_tables(method, surface.material)
        bound = {key: Bindings(context, found) for key, found in packed.items()}
        first = next(iter(bound.values()))
        # each surface's; what does not diffract is drawn by any of the programs
        self.tables = [
            first if s.material.bsdf is None else bound[id(s.material.table)]
            for s in scene.surfaces
        ]
        self.nbytes = sum(p.nbytes for p in packed.values())  # of the method's own textures
        self._programs: dict[tuple[tuple[str, str], ...], Any] = {}
        self._parts: dict[object, list[Part]] = {}

    def parts(
        self, light: Mapping[str, str], extras: Sequence[Mapping[str, str]] = ()
    ) -> list[Part]:
        """One part a surface.

        extras : more definitions of each surface.

        Raises a DiffractionError if the driver refuses a program.
        """
        more = list(extras) or [{}] * len(self._surfaces)
        key = tuple(tuple(sorted({**light, **one}.items())) for one in more)
        if key not in self._parts:
            made = []
            for own, tables, buffer, extra in zip(
                self._surfaces, self.tables, self._buffers, more, strict=True
            ):
                of_light = {**tables.definitions, **light, **extra}
                program = self.program({**own.definitions, **of_light})
                array = vertex_array(self._context, program, buffer)
                made.append(Part(program, array, tables))
            self._parts[key] = made
        return self._parts[key]

    def program(self, definitions: Mapping[str, str]) -> Any:
        """The method's program with these definitions, compiled once."""
        key = tuple(sorted(definitions.items()))
        if key not in self._programs:
            self._programs[key] = compile_program(self._context, self._method, definitions)
        return self._programs[key]

    def release(self) -> None:
        for parts in self._parts.values():
            for part in parts:
                part.array.release()
        for thing in (*{id(t): t for t in self.tables}.values(), *self._programs.values()):
            thing.release()


def method_tables(method: str, material: Material) -> Packed:
    """What a method reads of a material's table.

    Raises a DiffractionError if there is no such method, or the table does not suit it.
    """
    if method == "lut":
        return pack_colours(cached_colours(material.table))
    if method == "spectral":
        return pack_powers(material.table)
    if method in THESIS_METHODS:
        heights = material.bsdf.heights()
        return pack_method(thesis_method(method, heights, material.table))
    raise DiffractionError(f"method={method!r} is unknown; choose one of {', '.join(METHODS)}")


def window(tables: Bindings, coherence_width: float) -> dict[str, Uniform]:
    """Uniforms of another coherence window."""
    sigma = sigma_of(coherence_width)
    factor = area_factor(sigma)
    exponents, own = tables.uniforms.get("exponents"), tables.uniforms["area_factor"]
    found: dict[str, Uniform] = {"sigma": sigma, "area_factor": factor}
    if isinstance(exponents, tuple) and isinstance(own, float):
        found["exponents"] = tuple(float(e) * factor / own for e in exponents)  # both ∝ σ²
    return found


def vertex_array(context: Any, program: Any, buffer: Any) -> Any:
    """Those attributes of the vertices that the program reads."""
    used: Sequence[tuple[str, int]] = [(name, size) for name, size in VERTEX if name in program]
    layout = " ".join(f"{n}f" if name in program else f"{4 * n}x" for name, n in VERTEX)
    return context.vertex_array(program, [(buffer, layout, *(name for name, _ in used))])
