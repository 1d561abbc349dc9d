"""An OpenGL context without a window, programs and textures in it, and clear words if it fails."""

from __future__ import annotations

import os
import re
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...errors import DiffractionError
from .source import fragment_parts, plain_source, vertex_source
from .texels import PAGE, Packed, Texture, Uniform

#: OpenGL 3.3.
REQUIRED = 330

_SOFTWARE = re.compile("llvmpipe|softpipe|swr|SwiftShader", re.IGNORECASE)
_INSTALL = "apt install libegl1 libgl1 libgl1-mesa-dri"
_KINDS = {
    np.dtype(np.float16): "f2",
    np.dtype(np.float32): "f4",
    np.dtype(np.uint8): "f1",
    np.dtype(np.uint32): "u4",
}


def headless_context() -> Any:
    """A moderngl context through EGL: a graphics card, or Mesa's software rasteriser.

    Raises a DiffractionError if moderngl, EGL or a driver is missing, or the driver is older than
    OpenGL 3.3.
    """
    moderngl = require_moderngl()
    try:
        context = moderngl.create_standalone_context(backend="egl")
    except Exception as error:  # moderngl raises plain Exception, glcontext too
        reason = " ".join(str(error).split())
        raise DiffractionError(
            f"no OpenGL without a window ({reason}); install EGL and a driver: {_INSTALL}"
        ) from error
    try:
        check_version(context)
    except DiffractionError:
        context.release()
        raise
    return context


def require_moderngl() -> Any:
    """The module moderngl.

    Raises a DiffractionError if it is not installed.
    """
    try:
        import moderngl
    except ImportError as error:
        raise DiffractionError(
            "the shaders need moderngl: pip install 'mitsuba-diffraction[gl]'"
        ) from error
    return moderngl


def check_version(context: Any) -> None:
    """Raise a DiffractionError for a driver older than OpenGL 3.3, or with too small textures."""
    if context.version_code < REQUIRED:
        raise DiffractionError(
            f"the driver {context.info['GL_RENDERER']} has OpenGL "
            f"{context.version_code // 100}.{context.version_code % 100 // 10}, but the shaders "
            f"need {REQUIRED // 100}.{REQUIRED % 100 // 10}; update it, or use Mesa's software "
            f"rasteriser: LIBGL_ALWAYS_SOFTWARE=1"
        )
    largest = context.info["GL_MAX_TEXTURE_SIZE"]
    if largest < PAGE:
        raise DiffractionError(
            f"the driver {context.info['GL_RENDERER']} has textures of {largest} texels at most, "
            f"but the shaders need {PAGE}; use Mesa's software rasteriser: LIBGL_ALWAYS_SOFTWARE=1"
        )


def clock_of(driver: str) -> Callable[[], float]:
    """Seconds, for differences: what to time a driver's pictures with.

    Of a rasteriser in software this is the processor's time, shared evenly by its cores: other
    programs do not count, as they would not on a graphics card.
    """
    if not _SOFTWARE.search(driver):
        return time.perf_counter
    cores = len(os.sched_getaffinity(0))
    return lambda: time.process_time() / cores


def compile_program(
    context: Any,
    method: str,
    definitions: Mapping[str, str],
    *,
    vertex: str = "surface.vert",
    main: str = "surface.frag",
) -> Any:
    """A method's program.

    Raises a DiffractionError if the driver refuses it: the file, the line and the driver's words.
    """
    moderngl = require_moderngl()
    stage = vertex_source(name=vertex)
    parts = fragment_parts(method, definitions, main=main)
    try:
        return context.program(
            vertex_shader=stage, fragment_shader="".join(text for _, text in parts)
        )
    except moderngl.Error as error:
        log = str(error)
        if "vertex_shader" in log:
            parts = [(vertex, stage)]
        words = compiler_words(log, parts)
        raise DiffractionError(f"the driver cannot compile method {method}: {words}") from None


def compile_plain(
    context: Any,
    vertex: str,
    fragment: str,
    shared: Sequence[str] = (),
    definitions: Mapping[str, str] | None = None,
) -> Any:
    """A program of two files that know neither surfaces nor tables.

    shared, definitions : of the fragment stage, as of `source.plain_source`.
    """
    return context.program(
        vertex_shader=plain_source(vertex),
        fragment_shader=plain_source(fragment, shared, definitions),
    )


def compiler_words(log: str, parts: Sequence[tuple[str, str]]) -> str:
    """A compiler's log as one line: the file and line of the first error, and the words about it.

    parts : names and texts of the source, joined in this order.
    """
    # Mesa: "0:15(3): error: …", NVIDIA: "0(15) : error C1503: …", ANGLE: "ERROR: 0:15: …"
    for line in log.splitlines():
        found = re.search(r"\d+:(\d+)\(\d+\): error:|\d+\((\d+)\) : error|ERROR: \d+:(\d+):", line)
        if not found:
            continue
        row = next(int(n) for n in found.groups() if n is not None)
        for name, text in parts:
            if row <= text.count("\n"):
                return f"{name}, line {row}: {' '.join(line[found.end() :].split())}"
            row -= text.count("\n")
    return " ".join(log.split())[:400]


def upload(context: Any, texture: Texture) -> Any:
    """A texture in the graphics card's memory.

    Raises a DiffractionError if it is larger than the driver takes.
    """
    moderngl = require_moderngl()
    rows, columns, channels = texture.data.shape
    largest = context.info["GL_MAX_TEXTURE_SIZE"]
    if max(rows, columns) > largest:
        raise DiffractionError(
            f"texture {texture.name} of {columns} × {rows} texels is too large for "
            f"{context.info['GL_RENDERER']}, which takes {largest}"
        )
    data = np.ascontiguousarray(texture.data)
    kind = _KINDS[data.dtype]
    made = context.texture((columns, rows), channels, data.data, alignment=1, dtype=kind)
    made.filter = (moderngl.LINEAR, moderngl.LINEAR) if texture.smooth else (
        moderngl.NEAREST, moderngl.NEAREST
    )  # fmt: skip
    made.repeat_x = made.repeat_y = texture.smooth
    return made


class Target:
    """A picture in single precision, with depth.

    Raises a DiffractionError if the driver has no textures so large.
    """

    def __init__(self, context: Any, width: int, height: int) -> None:
        largest = context.info["GL_MAX_TEXTURE_SIZE"]
        if max(width, height) > largest:
            raise DiffractionError(
                f"a picture of {width} × {height} samples is too large for the driver, which "
                f"takes {largest}; lower the supersampling or the size"
            )
        self.colour = context.texture((width, height), 4, dtype="f4")
        self.depth = context.depth_renderbuffer((width, height))
        self.frame = context.framebuffer([self.colour], self.depth)

    def release(self) -> None:
        for thing in (self.frame, self.colour, self.depth):
            thing.release()


class Bindings:
    """The textures and uniforms of some parts, uploaded once, for any program that reads them."""

    def __init__(self, context: Any, parts: Packed) -> None:
        self.uniforms = dict(parts.uniforms)
        self.definitions = dict(parts.definitions)
        self.textures = {texture.name: upload(context, texture) for texture in parts.textures}

    def use(self, program: Any, first_unit: int = 0) -> int:
        """Set them in a program; returns the next free texture unit."""
        set_uniforms(program, self.uniforms)
        for name, texture in self.textures.items():
            if (sampler := program.get(name, None)) is not None:
                texture.use(first_unit)
                sampler.value = first_unit
                first_unit += 1
        return first_unit

    def release(self) -> None:
        for texture in self.textures.values():
            texture.release()


def set_uniforms(program: Any, uniforms: Mapping[str, Uniform]) -> None:
    """Set those that the program reads: compilers remove the others, and cut arrays short."""
    for name, value in uniforms.items():
        found = program.get(name, None)  # a program's `in` looks through all names
        if found is None:
            continue
        if isinstance(value, np.ndarray):
            found.write(np.ascontiguousarray(value[: found.array_length], np.float32))
        else:
            found.value = value
