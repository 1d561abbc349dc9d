"""OpenGL without a window: contexts, programs, textures, framebuffers, and errors of drivers."""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping, Sequence
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from ...errors import DiffractionError
from ...extras import optional
from .scene import VERTEX
from .source import joined, source_parts
from .texels import PAGE, Packed, Texture, Uniform, distinct_rows

#: Required version of OpenGL, 3.3.
REQUIRED = 330

Owned = TypeVar("Owned")

_INSTALL = "apt install libegl1 libgl1 libgl1-mesa-dri"


def headless_context() -> Any:
    """Create a moderngl context without a window, on a graphics card or Mesa's software rasteriser.

    Linux needs EGL; macOS and Windows bring their own context.

    Raises a DiffractionError if moderngl, EGL or a driver is missing, or the driver is older than
    OpenGL 3.3.
    """
    moderngl = optional("moderngl")
    try:
        backend = {"backend": "egl"} if sys.platform == "linux" else {}
        context = moderngl.create_standalone_context(**backend)
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


def check_version(context: Any) -> None:
    """Refuse a driver older than OpenGL 3.3, or with too small textures."""
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
            f"the driver {context.info['GL_RENDERER']} supports textures of {largest} texels at "
            f"most, but the shaders need {PAGE}; use Mesa's software rasteriser: "
            "LIBGL_ALWAYS_SOFTWARE=1"
        )


def compile_program(
    context: Any, name: str, parts: Sequence[tuple[str, str]], vertex: str = "surface.vert"
) -> Any:
    """Compile a program.

    name : of the program in messages.
    parts : names and texts of the fragment stage; vertex : file of the vertex stage.

    Raises a DiffractionError with file, line and the driver's message if it does not compile.
    """
    moderngl = optional("moderngl")
    stage = source_parts([vertex])
    try:
        return context.program(vertex_shader=joined(stage), fragment_shader=joined(parts))
    except moderngl.Error as error:
        log = str(error)
        words = compiler_words(log, stage if "vertex_shader" in log else parts)
        raise DiffractionError(f"the driver cannot compile {name}: {words}") from None


class Resources:
    """Owner of resources of OpenGL, which are freed together."""

    def own(self, resource: Owned) -> Owned:
        """Add a resource that `release` frees, and return it."""
        self.__dict__.setdefault("_owned", []).append(resource)
        return resource

    def release(self) -> None:
        """Free the graphics card's memory."""
        for resource in reversed(self.__dict__.pop("_owned", [])):
            resource.release()


class VertexBuffer(Resources):
    """Uploaded triangles. A vertex that several share is uploaded, and transformed, once.

    vertices : (n, 17), attributes as in `scene.VERTEX`; three consecutive ones are a triangle.
    """

    def __init__(self, context: Any, vertices: NDArray[np.float32]) -> None:
        self._context = context
        distinct, corners = distinct_rows(vertices)
        self._vertices = self.own(context.buffer(distinct.tobytes()))
        self._corners = self.own(context.buffer(corners.tobytes()))

    def array(self, program: Any) -> Any:
        """Return the vertex array of the attributes that a program reads."""
        names = [name for name, _ in VERTEX if name in program]
        layout = " ".join(f"{n}f" if name in program else f"{4 * n}x" for name, n in VERTEX)
        attributes = [(self._vertices, layout, *names)]
        return self._context.vertex_array(program, attributes, index_buffer=self._corners)


def enable_sides(context: Any, winding: int) -> None:
    """Draw with a depth test, and of closed surfaces only triangles that face the camera.

    winding : as of `scene.winding_of`; 0 draws all triangles.
    """
    context.cull_face = "back" if winding > 0 else "front"
    context.enable_only(context.DEPTH_TEST | (context.CULL_FACE if winding else context.NOTHING))


def compiler_words(log: str, parts: Sequence[tuple[str, str]]) -> str:
    """Shorten a compiler's log to one line: file, line and message of the first error.

    parts : names and texts of the source, joined in this order.
    """
    # Mesa: "0:15(3): error: …", NVIDIA: "0(15) : error C1503: …", ANGLE: "ERROR: 0:15: …"
    for line in log.splitlines():
        match = re.search(r"\d+:(\d+)\(\d+\): error:|\d+\((\d+)\) : error|ERROR: \d+:(\d+):", line)
        if not match:
            continue
        row = next(int(n) for n in match.groups() if n is not None)
        for name, text in parts:
            if row <= text.count("\n"):
                return f"{name}, line {row}: {' '.join(line[match.end() :].split())}"
            row -= text.count("\n")
    return " ".join(log.split())[:400]


def upload(context: Any, texture: Texture) -> Any:
    """Upload a texture to the graphics card.

    Raises a DiffractionError if it is larger than the driver supports.
    """
    rows, columns, channels = texture.data.shape
    largest = context.info["GL_MAX_TEXTURE_SIZE"]
    if max(rows, columns) > largest:
        raise DiffractionError(
            f"texture {texture.name} of {columns} × {rows} texels is too large for "
            f"{context.info['GL_RENDERER']}, which supports {largest}"
        )
    data = np.ascontiguousarray(texture.data)
    kind = "f1" if data.dtype == np.uint8 else data.dtype.str[1:]
    uploaded = context.texture((columns, rows), channels, data.data, alignment=1, dtype=kind)
    filtering = context.LINEAR if texture.smooth else context.NEAREST
    uploaded.filter = (filtering, filtering)
    uploaded.repeat_x = uploaded.repeat_y = texture.smooth
    return uploaded


class Target(Resources):
    """Framebuffer in single precision, with depth.

    Raises a DiffractionError if it is larger than the driver's textures.
    """

    def __init__(self, context: Any, width: int, height: int) -> None:
        largest = context.info["GL_MAX_TEXTURE_SIZE"]
        if max(width, height) > largest:
            raise DiffractionError(
                f"a picture of {width} × {height} samples is too large for the driver, which "
                f"supports {largest}; lower the supersampling or the size"
            )
        self.colour = self.own(context.texture((width, height), 4, dtype="f4"))
        depth = self.own(context.depth_renderbuffer((width, height)))
        self.frame = self.own(context.framebuffer([self.colour], depth))

    def read(self) -> NDArray[np.float32]:
        """Return the picture (height, width, 4), from the top row down."""
        pixels = np.frombuffer(self.frame.read(components=4, dtype="f4"), np.float32)
        return pixels.reshape(self.frame.height, self.frame.width, 4)[::-1]


class Bindings(Resources):
    """Uploaded textures and uniforms, for any program that reads them."""

    def __init__(self, context: Any, parts: Packed) -> None:
        self.uniforms = dict(parts.uniforms)
        self.definitions = dict(parts.definitions)
        self.textures = {t.name: self.own(upload(context, t)) for t in parts.textures}

    def use(self, program: Any, first_unit: int = 0) -> int:
        """Bind textures and uniforms in a program, and return the next free texture unit."""
        return bind(program, self.uniforms, self.textures, first_unit)


class ShaderPass(Resources):
    """Program of a triangle that covers the picture.

    files, definitions : of `source.source_parts` for the fragment stage.
    """

    def __init__(self, context: Any, *files: str, **definitions: str) -> None:
        self._context = context
        parts = source_parts(files, definitions)
        self._program = self.own(compile_program(context, files[-1], parts, "whole.vert"))
        self._triangle = self.own(context.vertex_array(self._program, []))

    def draw(
        self, uniforms: Mapping[str, Uniform], textures: Mapping[str, Any], *, adding: bool = False
    ) -> None:
        """Draw into the current framebuffer, or add to it."""
        context = self._context
        context.enable_only(context.BLEND if adding else context.NOTHING)
        context.blend_func = context.ONE, context.ONE
        bind(self._program, uniforms, textures)
        self._triangle.render(vertices=3)
        context.enable_only(context.NOTHING)


def bind(
    program: Any, uniforms: Mapping[str, Uniform], textures: Mapping[str, Any], first_unit: int = 0
) -> int:
    """Bind textures and uniforms that a program reads, and return the next free texture unit."""
    set_uniforms(program, uniforms)
    for name, texture in textures.items():
        if (sampler := program.get(name, None)) is not None:
            texture.use(first_unit)
            sampler.value = first_unit
            first_unit += 1
    return first_unit


def set_uniforms(program: Any, uniforms: Mapping[str, Uniform]) -> None:
    """Set the uniforms that the program reads: compilers remove others, and shorten arrays."""
    for name, value in uniforms.items():
        uniform = program.get(name, None)  # faster than `in`, which searches all names
        if uniform is None:
            continue
        if isinstance(value, np.ndarray):
            uniform.write(np.ascontiguousarray(value[: uniform.array_length], np.float32))
        else:
            uniform.value = value
