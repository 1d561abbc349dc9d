"""Surfaces and parameters of surfaces put into a parsed scene: each acts on shapes, or is refused.

A surface that the command line puts on an id replaces the BSDF of that id, or the BSDF of the shape
of that id. `twosided`, `mask`, `bumpmap` and `normalmap` around it are kept.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from ..errors import DiffractionError, counted
from ..files import FileKind, kind_of
from ..optics.materials import lets_light_through
from ..orders.file import load_orders
from ..plugin.description import Surface
from ..plugin.dictionary import ORDERS, PLUGINS
from ..plugin.parameters import NAMES
from ..plugin.presets import MATERIALS, find_preset
from ..plugin.presets import PLUGIN as PRESET_PLUGIN
from .elements import own_id, surfaces_within

#: Beginning of a surface that is a preset: `preset:NAME[,parameter=value…]`.
PRESET = "preset:"

_COMMA = re.compile(r",(?=\s*\w+=)")
REFLECTING, TRANSMITTING = PLUGINS
# With one of these the surface is opaque, and nothing lies beneath it.
_CONDUCTORS = ("eta", "k")
# BSDFs around another one that stay around the surface
_WRAPPERS = ("mask", "bumpmap", "normalmap")
_NAMED = 4  # shapes that a line lists


@dataclass(frozen=True)
class Edit:
    """A change of surfaces of a scene.

    Attributes
    ----------
    what : what was put where, for people.
    shapes : ids of the shapes that it changes.
    """

    what: str
    shapes: tuple[str, ...]

    def line(self, scene: Any) -> str:
        """Return the change in one line: its shapes, and the material of their surfaces.

        scene : `mi.Scene`, loaded.
        """
        names = [own_id(name) or "one without id" for name in self.shapes]
        listed = ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")
        count = counted(len(names), "shape")
        found = [s for shape in scene.shapes() if shape.id() in self.shapes
                 for s in surfaces_within(shape.bsdf())]  # fmt: skip
        materials = dict.fromkeys(_material(surface) for surface in found)
        return f"{self.what} on {count} ({listed})" + "".join(f"; {m}" for m in materials if m)


def _material(surface: Surface) -> str:
    """Return the material of a surface and its index in the middle of the visible range."""
    if surface.index is None:
        return "" if surface.solved else surface.text
    n = complex(np.ravel(surface.index(np.array([550.0])))[0])
    return f"{surface.text}, n = {n.real:.4g}" + (f" + {n.imag:.4g}i" if n.imag else "")


def put_materials(
    state: Any, materials: Mapping[str, str], of_meshes: Sequence[str] = ()
) -> list[Edit]:
    """Put surfaces on the BSDFs or shapes of these ids.

    A dielectric, the default, keeps the BSDF of the scene beneath it, as its pigment. A conductor,
    a table of orders, or a dielectric that light goes through (`thin`) replaces it.

    state : `mi.parser.ParserState`.
    materials : `FILE[,parameter=value…]` or `preset:NAME[,parameter=value…]` by id.
    of_meshes : names of materials of the scene's mesh files, for messages.

    Raises a DiffractionError if an id is unknown, with a list of the scene's; if two ids are of one
    BSDF; or if no shape uses a BSDF.
    """
    numbers = {name: _node_of(state, name, of_meshes) for name in materials}
    for name, number in numbers.items():
        if twice := [other for other, n in numbers.items() if n == number and other != name]:
            raise DiffractionError(f"{name!r} and {twice[0]!r}: both ids are of one BSDF; keep one")
    # BSDFs first: a shape takes over what lies beneath its own surface
    for name, number in sorted(
        numbers.items(), key=lambda pair: state.nodes[pair[1]].type == mi.ObjectType.Shape
    ):
        _put(state, number, materials[name])
    edits = []
    for name, number in numbers.items():
        is_shape = state.nodes[number].type == mi.ObjectType.Shape
        shapes = (name,) if is_shape else _shapes_with(state, number)
        if not shapes:
            others = ", ".join(other for other in numbers if other != name)
            raise DiffractionError(
                f"no shape is left that uses the BSDF {name!r}, since {others} got surfaces of "
                "their own; leave one out"
            )
        file, *rest = _COMMA.split(materials[name], maxsplit=1)
        label = file.removeprefix(PRESET) if file.startswith(PRESET) else Path(file).name
        edits.append(Edit(f"{name}: {', '.join([label, *rest])}", shapes))
    return edits


def _shapes_with(state: Any, number: int) -> tuple[str, ...]:
    """Return the ids of the shapes that use a BSDF, directly or within another one."""
    return tuple(
        node.props.id()
        for node in state.nodes
        if node.type == mi.ObjectType.Shape and number in _reached(state, [node])
    )


def _reached(state: Any, nodes: Iterable[Any]) -> set[int]:
    """Return the numbers of the nodes within nodes, and within those."""
    waiting, reached = list(nodes), set[int]()
    while waiting:
        new = {*targets_of(waiting.pop()).values()} - reached
        reached |= new
        waiting += [state.nodes[number] for number in new]
    return reached


def effective(state: Any) -> list[str]:
    """Return the properties of all nodes but those of BSDFs that no shape uses."""
    hidden = (mi.ObjectType.BSDF, mi.ObjectType.Texture, mi.ObjectType.Scene)
    seen = {n: node for n, node in enumerate(state.nodes) if node.type not in hidden}
    numbers = sorted({*seen} | _reached(state, seen.values()))
    return [str(state.nodes[number].props) for number in numbers]


def put_surface_parameters(state: Any, values: Mapping[str, Any]) -> list[Edit]:
    """Set parameters of the BSDF on all diffracting surfaces of shapes that have them.

    state : `mi.parser.ParserState`.

    Raises a DiffractionError if no surface of a shape has one of them.
    """
    edits = []
    for name, text in values.items():
        value = _value(str(text))
        shapes = {n: used for n, node in enumerate(state.nodes)
                  if name in _parameters_of(node) and (used := _shapes_with(state, n))}  # fmt: skip
        if not shapes:
            raise DiffractionError(
                f"{name}={text} is a parameter of a diffracting surface, and no shape of the scene "
                "has one that takes it; put one on an id as a material or a preset"
            )
        for number in shapes:
            props = state.nodes[number].props
            for other in MATERIALS if name in MATERIALS else (name,):
                if other in props:
                    del props[other]
            props[name] = value
        changed = dict.fromkeys(shape for used in shapes.values() for shape in used)
        edits.append(Edit(f"{name}={text}", tuple(changed)))
    return edits


def _parameters_of(node: Any) -> tuple[str, ...]:
    """Return the names of a surface's parameters; none of other nodes."""
    plugin = node.props.plugin_name() if node.type == mi.ObjectType.BSDF else ""
    if plugin == PRESET_PLUGIN:
        plugin = find_preset(str(node.props["preset"])).plugin
    return NAMES.get(plugin, ())


def _node_of(state: Any, name: str, of_meshes: Sequence[str]) -> int:
    """Return the number of the shape of this id, or of the BSDF, which a shape uses."""
    shape, bsdf = mi.ObjectType.Shape, mi.ObjectType.BSDF
    numbers = {k: n for k, n in state.id_to_index.items() if own_id(k)}

    def serves(number: int) -> bool:
        kind = state.nodes[number].type
        return kind == shape or (kind == bsdf and bool(_shapes_with(state, number)))

    if name in numbers and serves(numbers[name]):
        return int(numbers[name])
    known = (k for k, n in sorted(numbers.items(), key=lambda pair: pair[::-1]) if serves(n))
    meshes = f"; materials of its meshes are {', '.join(of_meshes)}" if of_meshes else ""
    raise DiffractionError(
        f"no shape has the id {name!r}, and no shape uses a BSDF, or a material of a glTF mesh, "
        f"{name!r}; there are {', '.join(known) or 'none: add id attributes to the scene'}{meshes}"
    )


def _put(state: Any, number: int, text: str) -> None:
    """Put a surface on a shape or in place of a BSDF."""
    # what is read of a node is read before others are appended, which moves all
    props = state.nodes[number].props
    name = props.id()
    if state.nodes[number].type == mi.ObjectType.Shape:
        targets = inner(state, state.nodes[number], mi.ObjectType.BSDF)
        beneath = [*targets.values()][-1] if targets else None
        changed = copied(props, props.plugin_name(), leave=[*targets])
        replaced = _with_surface(state, beneath, text, nested=False)
        changed["bsdf"] = appended(state, mi.ObjectType.BSDF, replaced)
    else:
        nested = any(
            other.type == mi.ObjectType.BSDF
            and number in inner(state, other, mi.ObjectType.BSDF).values()
            for other in state.nodes
        )
        # what may lie beneath
        before = appended(state, mi.ObjectType.BSDF, copied(props, props.plugin_name()))
        changed = _with_surface(state, before.index(), text, nested)
    changed.set_id(name)
    state.nodes[number].props = changed


def _with_surface(state: Any, number: int | None, text: str, nested: bool) -> Any:
    """Return the properties of a BSDF with the surface in place of what lies in its wrappers.

    number : of the BSDF, or None.
    nested : whether it is part of another BSDF; otherwise the surface has both sides, unless light
        goes through it.
    """
    if number is not None:
        props = state.nodes[number].props
        bsdfs = inner(state, state.nodes[number], mi.ObjectType.BSDF)
        name, wrapped = next(iter(bsdfs.items()), ("", number))
        two_sided = props.plugin_name() == "twosided"
        if props.plugin_name() in _WRAPPERS or (
            two_sided and state.nodes[wrapped].props.plugin_name() in _WRAPPERS
        ):
            copy = copied(props, props.plugin_name(), leave=[name])
            within = _with_surface(state, wrapped, text, nested or two_sided)
            copy[name] = appended(state, mi.ObjectType.BSDF, within)
            return copy
        number = wrapped if two_sided else number
    surface = _surface(state, text, number)
    plugin = surface.plugin_name()
    through = plugin == TRANSMITTING or (
        plugin == ORDERS and load_orders(surface["filename"]).sides == 2
    )
    if nested or through:
        return surface
    props = mi.Properties("twosided")
    props["bsdf"] = appended(state, mi.ObjectType.BSDF, surface)
    return props


def inner(state: Any, node: Any, kind: Any) -> dict[str, int]:
    """Return the numbers of the nodes of a kind within a node, by the names of its properties.

    kind : of `mi.ObjectType`.
    """
    return {name: n for name, n in targets_of(node).items() if state.nodes[n].type == kind}


def targets_of(node: Any) -> dict[str, int]:
    """Return the numbers of the nodes within a node, by the names of its properties."""
    props = node.props
    return {
        name: int(props[name].index())
        for name in list(props.keys())
        if props.type(name) == mi.Properties.Type.ResolvedReference
    }


def _surface(state: Any, text: str, beneath: int | None) -> Any:
    """Return the properties of a BSDF for `FILE[,parameter=value…]`, or a preset.

    A preset has its own BSDF. A file has the BSDF `diffraction`; `diffraction_orders` if it is a
    table of orders; or `diffraction_dielectric` if the parameter `thin` is set. In place of
    another diffracting surface it keeps that surface's orientation and what lies beneath that one.
    """
    file, *parameters = _COMMA.split(text)
    pairs = [parameter.partition("=")[::2] for parameter in parameters]
    values: dict[str, Any] = {name.strip(): _value(value.strip()) for name, value in pairs}
    named = file.startswith(PRESET)
    if named:
        values = find_preset(file.removeprefix(PRESET)).changed(values)
        plugin = values.pop("type")
    else:
        solved = kind_of(file) is FileKind.ORDERS
        plugin = ORDERS if solved else TRANSMITTING if "thin" in values else REFLECTING
        values["filename"] = str(Path(file).absolute())
    names = list(values)
    props = mi.Properties(plugin)
    for name, value in values.items():
        props[name] = value
    opaque = named or plugin != REFLECTING or bool(set(names) & {*_CONDUCTORS, "pigment"})
    opaque = opaque or not lets_light_through(values.get("material", "keratin"))
    if beneath is None:
        return props
    old = state.nodes[beneath].props
    if not old.plugin_name().startswith("diffraction"):
        if not opaque:
            props["beneath"] = mi.Properties.ResolvedReference(beneath)
        return props
    if "orientation" in old and "orientation" not in names:
        props["orientation"] = old["orientation"]
    if not opaque:  # what lay beneath that one: a metal under a skin would look like chrome
        if "pigment" in old:
            props["pigment"] = old["pigment"]
        for target in inner(state, state.nodes[beneath], mi.ObjectType.BSDF).values():
            props["beneath"] = mi.Properties.ResolvedReference(target)
    return props


def _value(text: str) -> float | bool | str:
    """Return a parameter's value as XML would declare it: number, boolean or string."""
    if text in ("true", "false"):
        return text == "true"
    try:
        return float(text)
    except ValueError:
        return text


def appended(state: Any, kind: Any, props: Any) -> Any:
    """Add a node of a kind to the scene, and return a reference to it.

    All nodes may move in memory: references to nodes in Python end.
    """
    node = mi.parser.SceneNode()
    node.type, node.props = kind, props
    state.nodes.append(node)
    return mi.Properties.ResolvedReference(len(state.nodes) - 1)


def copied(props: Any, plugin: str, leave: Sequence[str] = ()) -> Any:
    """Return properties without their id, for a plugin of this name."""
    copy = mi.Properties(plugin)
    for name in props.keys():  # noqa: SIM118 - Properties is no mapping
        if name not in leave:
            copy[name] = props[name]
    return copy
