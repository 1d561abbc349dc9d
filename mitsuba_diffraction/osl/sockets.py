"""Sockets of the shaders: declared once for the OSL source and for the script in Blender."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any


@dataclass(frozen=True)
class Socket:
    """Input of a shader that Blender shows.

    Attributes
    ----------
    identifier : name of the parameter in OSL.
    label : name that Blender shows, with the unit.
    kind : type in OSL, "float", "color", "vector", "normal" or "string".
    default : value, or for vectors the global variable of OSL; colours have three numbers.
    help : tooltip.
    """

    identifier: str
    label: str
    kind: str
    default: Any
    help: str

    def declaration(self) -> str:
        """Return the declaration of the parameter with its metadata."""
        value = self.default
        if self.kind == "string":
            value = f'"{value}"'
        elif self.kind == "color":
            value = f"color({', '.join(f'{x:.9g}' for x in value)})"
        elif self.kind == "float":
            value = f"{float(value)!r}"
        widget = ' string widget = "null",' if self.kind in ("vector", "normal") else ""
        return (
            f"{self.kind} {self.identifier} = {value}\n"
            f'        [[{widget} string label = "{self.label}", string help = "{self.help}" ]]'
        )

    def document(self) -> dict[str, Any]:
        """Return the socket for the script in Blender, as JSON types.

        Vectors have no default: the shader takes the surface's own while nothing is linked.
        """
        unlinked = {"default": None} if self.kind in ("vector", "normal") else {}
        return {**asdict(self), **unlinked}


def array_parameter(kind: str, name: str, rows: Iterable[Any]) -> str:
    """Return the declaration of a parameter that is a constant array, which Blender hides.

    kind : "float" or "color"; rows of the latter have three numbers.
    """
    items = [
        f"color({', '.join(f'{x:.7g}' for x in row)})" if kind == "color" else f"{row:.7g}"
        for row in rows
    ]
    return f"{kind} {name}[{len(items)}] = {{{', '.join(items)}}}"


#: Sockets of some shaders, with the defaults of sunlight on the heights as they are.
_SOCKETS = (
    Socket(
        "CoherenceWidth", "Coherence Width (µm)", "float", 65.0,
        "Width over which light is coherent, 65 in sunlight. Narrower windows blur the mirror and "
        "the orders: the roughness of their lobes. A small scan limits the orders' width",
    ),
    Socket(
        "HeightScale", "Height Scale", "float", 1.0,
        "Factor on the heights, 0 to {most:g}: the table has no deeper surface",
    ),
    Socket(
        "Stretch", "Stretch", "float", 1.0,
        "Factor on the lengths of the patch: colours come nearer to the mirror direction above 1, "
        "and go away from it below",
    ),
    Socket(
        "Rotation", "Rotation (°)", "float", 0.0,
        "Angle in degrees from the tangent to the x axis of the patch, across the grooves",
    ),
    Socket(
        "Pigment", "Pigment", "color", (0.0, 0.0, 0.0),
        "Colour beneath, which receives the light that is not reflected; black for metals",
    ),
    Socket(
        "WorkingSpace", "Working Space", "string", "Linear Rec.709",
        "Working space of the file, Blender's name; Linear Rec.2020 has less noise than Linear "
        "Rec.709",
    ),
    Socket("Normal", "Normal", "normal", "N", "Normal of the surface"),
    Socket("Tangent", "Tangent", "vector", "dPdu", "Direction of u; link a Tangent node, UV Map"),
)  # fmt: skip
#: Sockets that all shaders have.
_COMMON = ("WorkingSpace", "Normal", "Tangent")


def sockets_of(defaults: Mapping[str, Any], most: float = 1.0) -> list[Socket]:
    """Return the sockets with these defaults, by identifier, and those that all shaders have.

    most : largest height scale.
    """
    return [
        replace(
            socket,
            default=defaults.get(socket.identifier, socket.default),
            help=socket.help.format(most=most),
        )
        for socket in _SOCKETS
        if socket.identifier in (*defaults, *_COMMON)
    ]
