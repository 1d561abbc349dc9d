"""Meshes and materials put into a parsed scene, before Mitsuba makes objects of it.

A shape of type `fitted_mesh` becomes a mesh on the stage (`fitted_mesh.py`). A surface that the
command line puts on an id replaces the BSDF of that id, or the BSDF of the shape of that id.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from ..errors import DiffractionError, check_choice
from ..files import FileKind, kind_of
from ..optics.materials import lets_light_through
from ..orders.file import load_orders
from ..plugin.dictionary import ORDERS, PLUGINS
from ..plugin.parameters import NAMES
from ..plugin.presets import MATERIALS, find_preset
from ..plugin.presets import PLUGIN as PRESET_PLUGIN
from .fitted_mesh import FRAMES, fitted_mesh, framing, turned_around
from .orbit import ORBIT
from .orientation.mesh_files import write_ply

#: Shape that is put on the stage.
FITTED = "fitted_mesh"
#: Prefix of scene parameters that are surfaces for ids: `material:ID` = `FILE[,parameter=value…]`.
MATERIAL = "material:"
#: Beginning of a surface that is a named look: `preset:NAME[,parameter=value…]`.
PRESET = "preset:"
#: Scene parameter that limits samples, in units of white.
CLAMP = "render:clamp"

_COMMA = re.compile(r",(?=\s*\w+=)")
REFLECTING, TRANSMITTING = PLUGINS
# With one of these the surface is opaque, and nothing lies beneath it.
_CONDUCTORS = ("eta", "k")


class SceneValues(NamedTuple):
    """Values for a scene.

    Attributes
    ----------
    parameters : of the scene's own parameters.
    materials : surfaces by the id that they are put on.
    surface : parameters of the BSDF, for all diffracting surfaces of the scene.
    clamp : limit of samples in units of white, or None.
    orbit : degrees by which the cameras are turned around the vertical.
    """

    parameters: dict[str, Any]
    materials: dict[str, str]
    surface: dict[str, Any]
    clamp: float | None
    orbit: float


def split_values(values: Mapping[str, Any], known: Collection[str]) -> SceneValues:
    """Separate values of a scene's parameters from surfaces for its ids and their parameters.

    known : names of the scene's parameters, which precede the BSDF's.
    """
    materials = {k[len(MATERIAL) :]: v for k, v in values.items() if k.startswith(MATERIAL)}
    own = (CLAMP, ORBIT)
    rest = {k: v for k, v in values.items() if not k.startswith(MATERIAL) and k not in own}
    surface = {k: v for k, v in rest.items() if k not in known and k in NAMES[REFLECTING]}
    clamp = float(values[CLAMP]) if CLAMP in values else None
    parameters = {k: v for k, v in rest.items() if k not in surface}
    return SceneValues(parameters, materials, surface, clamp, float(values.get(ORBIT, 0.0)))


def fit_meshes(state: Any, folder: Path) -> None:
    """Replace shapes of type `fitted_mesh` by PLY files of the fitted meshes.

    state : `mi.parser.ParserState`.
    folder : where the files are written.

    Raises a DiffractionError if a file is not a mesh, or cannot be put on the stage.
    """
    for number, node in enumerate(state.nodes):
        if node.props.plugin_name() != FITTED:
            continue
        props = node.props
        if "filename" not in props:
            raise DiffractionError(f"shape '{FITTED}': the parameter filename is missing")
        file = Path(str(mi.file_resolver().resolve(props["filename"])))
        mesh = fitted_mesh(file, fit=_boolean(props, "fit"), up=props.get("up", "auto"))
        written = folder / f"{number}.ply"
        write_ply(written, mesh)
        _frame(state, mesh.positions, props)
        ply = _copy(props, "ply", leave=("filename", "fit", "up", "frame"))
        ply["filename"] = str(written)
        node.props = ply


def _frame(state: Any, positions: NDArray[np.float64], shape: Any) -> None:
    """Move the scene's first camera until the mesh of a shape fills its picture."""
    frame = str(shape.get("frame", FRAMES[0]))
    check_choice("frame", frame, FRAMES)
    sensor = next((n for n in state.nodes if n.type == mi.ObjectType.Sensor), None)
    if frame == FRAMES[0] or sensor is None:
        return
    matrix = np.array(shape["to_world"].matrix) if "to_world" in shape else np.eye(4)
    placed = positions @ matrix[:3, :3].T + matrix[:3, 3]
    props = sensor.props
    pose = np.array(props["to_world"].matrix)
    film = next(state.nodes[n].props for n in _targets(sensor).values()
                if state.nodes[n].type == mi.ObjectType.Film)  # fmt: skip
    size = np.array([film.get("width", 768), film.get("height", 576)], float)
    tangents = size / size.min() * np.tan(np.radians(float(props["fov"]) / 2))
    seen = turned_around(placed) if frame == "turning" else placed
    pose[:3, 3] = framing(seen, pose[:3, :3], (tangents[0], tangents[1]))
    del props["to_world"]
    props["to_world"] = mi.ScalarTransform4f(pose)


def _boolean(props: Any, name: str) -> bool:
    """Read a parameter of a scene: true or false, as text."""
    text = str(props.get(name, "true")).lower()
    if text not in ("true", "false"):
        raise DiffractionError(f"{name}={text!r} must be true or false")
    return text == "true"


def put_materials(state: Any, materials: Mapping[str, str]) -> None:
    """Put surfaces on the BSDFs or shapes of these ids.

    A dielectric, the default, keeps the BSDF of the scene beneath it, as its pigment. A conductor,
    a table of orders, or a dielectric that light goes through (`thin`) replaces it.

    state : `mi.parser.ParserState`.
    materials : `FILE[,parameter=value…]` or `preset:NAME[,parameter=value…]` by id.

    Raises a DiffractionError if an id is unknown; the text lists the scene's.
    """
    for name, text in materials.items():
        number = _node_of(state, name)
        if state.nodes[number].type == mi.ObjectType.Shape:
            _put_on_shape(state, number, text)
        else:
            _put_on_bsdf(state, number, text)


def put_surface_parameters(state: Any, values: Mapping[str, Any]) -> None:
    """Set parameters of the BSDF on all diffracting surfaces that have them.

    state : `mi.parser.ParserState`.

    Raises a DiffractionError if no surface has one of them.
    """
    for name, text in values.items():
        value = _value(str(text))
        surfaces = [node.props for node in state.nodes if name in _parameters_of(node)]
        if not surfaces:
            raise DiffractionError(
                f"{name}={text} is a parameter of a diffracting surface, and the scene has none "
                "that takes it; put one on an id as a material or a preset"
            )
        for props in surfaces:
            for other in MATERIALS if name in MATERIALS else (name,):
                if other in props:
                    del props[other]
            props[name] = value


def _parameters_of(node: Any) -> tuple[str, ...]:
    """Return the names of a surface's parameters; none of other nodes."""
    plugin = node.props.plugin_name() if node.type == mi.ObjectType.BSDF else ""
    if plugin == PRESET_PLUGIN:
        plugin = find_preset(str(node.props["preset"])).plugin
    return NAMES.get(plugin, ())


def remove_dark_lights(state: Any) -> None:
    """Remove emitters of daylight's spectrum at scale 0, which Mitsuba refuses.

    state : `mi.parser.ParserState`, its references resolved.
    """

    nodes = state.nodes
    black = {
        number
        for number, node in enumerate(nodes)
        if node.props.plugin_name() == "d65" and float(node.props.get("scale", 1.0)) == 0.0
    }
    if not black:  # reading a property hides from Mitsuba that no plugin reads it
        return
    dark = {
        number
        for number, node in enumerate(nodes)
        if node.type == mi.ObjectType.Emitter and black.intersection(_targets(node).values())
    }
    for node in nodes:
        for name, target in _targets(node).items():
            if target in dark:
                del node.props[name]


def put_box_filters(state: Any) -> None:
    """Give all films box filters, which keep the noise of each pixel apart, as denoisers need it.

    state : `mi.parser.ParserState`, its references resolved.
    """
    for node in state.nodes:
        if node.type != mi.ObjectType.Film:
            continue
        for name, target in _targets(node).items():
            if state.nodes[target].type == mi.ObjectType.ReconstructionFilter:
                del node.props[name]
        node.props["box"] = mi.load_dict({"type": "box"})


def _node_of(state: Any, name: str) -> int:
    """Return the number of the BSDF or shape of this id."""
    kinds = (mi.ObjectType.BSDF, mi.ObjectType.Shape)
    known = {k: n for k, n in state.id_to_index.items() if state.nodes[n].type in kinds}
    if name not in known:
        listed = ", ".join(sorted(known, key=lambda k: (known[k], k)))
        raise DiffractionError(
            f"{MATERIAL}{name}: no BSDF or shape of the scene has this id; there are "
            f"{listed or 'none: add id attributes to the scene'}"
        )
    return int(known[name])


def _put_on_shape(state: Any, number: int, text: str) -> None:
    """Give a shape a BSDF with the surface, over the scene's BSDF."""
    shape = state.nodes[number].props
    targets = {
        name: target
        for name, target in _targets(state.nodes[number], state.id_to_index).items()
        if state.nodes[target].type == mi.ObjectType.BSDF
    }
    beneath = _inside(state, [*targets.values()][-1]) if targets else None
    surface = _surface(state, text, beneath)
    changed = _copy(shape, shape.plugin_name(), leave=[*targets])
    changed.set_id(shape.id())
    changed["bsdf"] = mi.Properties.ResolvedReference(_append(state, _two_sided(state, surface)))
    state.nodes[number].props = changed


def _put_on_bsdf(state: Any, number: int, text: str) -> None:
    """Replace a BSDF by the surface over it; both sides, unless it is part of another BSDF."""
    props = state.nodes[number].props
    name, inside = props.id(), _inside(state, number)
    if inside == number:  # the node is replaced, so the nested BSDF needs its own
        inside = _append(state, _copy(props, props.plugin_name()))
    surface = _surface(state, text, inside)
    nested = any(
        node.type == mi.ObjectType.BSDF and number in _targets(node).values()
        for node in state.nodes
    )
    replaced = surface if nested else _two_sided(state, surface)
    replaced.set_id(name)
    state.nodes[number].props = replaced


def _inside(state: Any, number: int) -> int:
    """Return the number of the BSDF within `twosided`, or of the BSDF itself."""
    node = state.nodes[number]
    if node.props.plugin_name() != "twosided":
        return number
    return next(iter(_targets(node).values()), number)


def _targets(node: Any, ids: Mapping[str, int] | None = None) -> dict[str, int]:
    """Return the numbers of the nodes within a node, by the names of its properties.

    ids : numbers by id, to which references that Mitsuba has not resolved are looked up.
    """
    props, kinds = node.props, mi.Properties.Type
    found = {}
    for name in list(props.keys()):
        if props.type(name) == kinds.ResolvedReference:
            found[name] = int(props[name].index())
        elif ids and props.type(name) == kinds.Reference and props[name].id() in ids:
            found[name] = ids[props[name].id()]
    return found


def _surface(state: Any, text: str, beneath: int | None) -> Any:
    """Return the properties of a BSDF for `FILE[,parameter=value…]`, or a named look.

    The BSDF of a look is the look's. A file has the BSDF `diffraction`; `diffraction_orders` if it
    is a table of orders; or `diffraction_dielectric` if the parameter `thin` is set. In place of
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
        values["table" if solved else "heightfield"] = str(Path(file).absolute())
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
        for target in _targets(state.nodes[beneath]).values():
            if state.nodes[target].type == mi.ObjectType.BSDF:
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


def _two_sided(state: Any, surface: Any) -> Any:
    """Return a BSDF with the surface on both sides, or the surface if light goes through it."""
    name = surface.plugin_name()
    if name == TRANSMITTING or (name == ORDERS and load_orders(surface["table"]).sides == 2):
        return surface
    props = mi.Properties("twosided")
    props["bsdf"] = mi.Properties.ResolvedReference(_append(state, surface))
    return props


def _append(state: Any, props: Any) -> int:
    """Add a BSDF to the scene; return its number."""
    node = mi.parser.SceneNode()
    node.type, node.props = mi.ObjectType.BSDF, props
    state.nodes.append(node)
    return len(state.nodes) - 1


def _copy(props: Any, plugin: str, leave: Sequence[str] = ()) -> Any:
    """Return properties without their id, for a plugin of this name."""
    copy = mi.Properties(plugin)
    for name in props.keys():  # noqa: SIM118 - Properties is no mapping
        if name not in leave:
            copy[name] = props[name]
    return copy
