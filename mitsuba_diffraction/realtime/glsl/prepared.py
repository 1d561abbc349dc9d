"""What one method needs to draw a scene: its tables, and a program for each surface."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from ...errors import DiffractionError
from ...optics.geometry import sigma_of
from ...tables.store import cached_colours
from .context import Bindings, compile_program
from .materials import Material
from .packing import area_factor, pack_colours, pack_powers
from .scene import VERTEX, RealtimeScene
from .source import METHODS, THESIS_METHODS
from .texels import Packed, Uniform
from .thesis import pack_method, thesis_method


class Part:
    """One surface's program, its vertices in it, and its tables."""

    def __init__(self, program: Any, array: Any, tables: Bindings) -> None:
        self.program, self.array, self.tables = program, array, tables


class Prepared:
    """Programs and tables of one method for all surfaces of a scene.

    Parameters
    ----------
    context : of moderngl.
    scene : what is drawn.
    method : one of `source.METHODS`.
    surfaces : what each surface's shader reads but for the method's tables.
    buffers : each surface's vertices.

    Attributes
    ----------
    nbytes : of the method's own textures.
    tables : each surface's; of what does not diffract those of the first that does.

    Raises
    ------
    DiffractionError
        If there is no such method, or a table does not suit it.
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
        # what does not diffract is drawn by any of the programs
        first = next(iter(bound.values()))
        self.tables = [
            first if s.material.bsdf is None else bound[id(s.material.table)]
            for s in scene.surfaces
        ]
        self.nbytes = sum(p.nbytes for p in packed.values())
        self._programs: dict[tuple[tuple[str, str], ...], Any] = {}
        self._parts: dict[object, list[Part]] = {}

    def parts(
        self, light: Mapping[str, str], extras: Sequence[Mapping[str, str]] = ()
    ) -> list[Part]:
        """One part a surface.

        Parameters
        ----------
        light : of `lights.light_definitions`.
        extras : more definitions of each surface.

        Raises
        ------
        DiffractionError
            If the driver refuses a program.
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
        """Free what lies in the graphics card's memory."""
        for parts in self._parts.values():
            for part in parts:
                part.array.release()
        for thing in (*{id(t): t for t in self.tables}.values(), *self._programs.values()):
            thing.release()


def method_tables(method: str, material: Material) -> Packed:
    """What a method reads of a material's table.

    Raises
    ------
    DiffractionError
        If there is no such method, or the table does not suit it.
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
