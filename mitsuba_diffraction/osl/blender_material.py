"""Add the diffracting material of this folder to a Blender file (Cycles, Open Shading Language).

In Blender: open this file in the Text editor and run it. From a terminal:

    blender file.blend --python blender_material.py -- --object Disc

or with Python and the package `bpy`, which adds to a copy of a file, scene_diffraction.blend unless
--output names another, or with --output alone to a new file:

    python blender_material.py --blend scene.blend --object Disc --output out.blend

The script switches Cycles and OSL on and adds a node group with labelled inputs, and a material
that uses it. Run it again after a new export: materials that use the group change with it.
Needs Blender 5.0 or newer alone.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

try:
    import bpy
    import mathutils
except ModuleNotFoundError:  # `main` says so
    bpy = mathutils = None

#: Folder of the exported shader, if this text was pasted and not opened as a file.
FOLDER = ""
#: Oldest Blender whose closures and node groups the shader was tested with.
OLDEST = (5, 0)
# custom properties of materials and node groups: shader that made them, and the name asked for
_SHADER, _NAME = "mitsuba_diffraction_shader", "mitsuba_diffraction_name"
#: Name and axis of each choice of --tangent.
TANGENTS = {"uv": ("UV_MAP", "Z")} | {f"radial-{axis.lower()}": ("RADIAL", axis) for axis in "XYZ"}


class MaterialError(Exception):
    """The material cannot be added; the message is one line."""


def add_material(
    folder: str | os.PathLike[str],
    *,
    name: str = "",
    tangent: str = "uv",
    orientation: str | os.PathLike[str] | None = None,
    stretch: str | os.PathLike[str] | None = None,
    weight: str | os.PathLike[str] | None = None,
    shared: Path | None = None,
) -> Any:
    """Return a new material that shows the shader of an exported folder.

    Parameters
    ----------
    folder : exported folder: a shader (`.osl`), its sockets (`.json`) and its textures.
    name : of the material and its node group; by default the shader's. Groups that this
        folder made under the name are rebuilt, and groups of a deleted folder; beside any
        others Blender adds a number to the name.
    tangent : key of `TANGENTS`: direction of the patch's x axis before Rotation. `uv` is along
        the first texture coordinate, `radial-z` runs around the object's z axis.
    orientation, stretch, weight : pictures of a hologram, as `mitsuba-diffraction hologram` writes
        them: cosine and sine of the patch's angle, factor on its lengths, and 1 where it lies; the
        rest is plain glossy metal.
    shared : folder of textures that several exported folders name.
    """
    check_blender()
    exported = read_folder(Path(folder), shared)
    name = name or exported["shader"].stem.replace("_", " ")
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.shading_system = True
    group = _group(exported, name)
    material = own_data(bpy.data.materials, name, exported["shader"])
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    surface = _node(nodes, "ShaderNodeGroup", (0, 0))
    surface.node_tree = group
    surface.label, surface.width = group.name, 240
    _link_tangent(nodes, links, surface, tangent)
    _link_hologram(nodes, links, surface, orientation, stretch)
    last = surface if weight is None else _masked(nodes, links, surface, weight)
    links.new(last.outputs[0], _node(nodes, "ShaderNodeOutputMaterial", (520, 0)).inputs[0])
    return material


def check_blender() -> None:
    """Check that this is a Blender that runs the shader.

    Raises a MaterialError outside Blender, in an older Blender, and in a Blender without OSL.
    """
    if bpy is None:
        raise MaterialError(
            "this Python has no module bpy; run this file in Blender's Text editor, by "
            "'blender --python', or after 'pip install bpy'"
        )
    if bpy.app.version < OLDEST:
        raise MaterialError(
            f"Blender {bpy.app.version_string} is too old; the shader needs Blender "
            f"{OLDEST[0]}.{OLDEST[1]} or newer"
        )
    try:
        import _cycles

        with_osl = _cycles.with_osl
    except ModuleNotFoundError:
        with_osl = False
    if not with_osl:
        raise MaterialError(
            f"this Blender {bpy.app.version_string} was built without Open Shading Language; "
            "use a Blender from blender.org, or 'pip install bpy'"
        )


def give_material(target: Any, material: Any, slot: str = "") -> None:
    """Give an object a material in a slot; its other slots, and objects of its mesh, keep theirs.

    slot : name of the slot's material, or number from 1; may be left out of an object with one.

    Raises a MaterialError that lists the slots if it is none of them, or several.
    """
    names = [entry.name or "empty" for entry in target.material_slots]
    listed = ", ".join(f"{number} {name}" for number, name in enumerate(names, 1)) or "none"
    if slot and slot not in (*names, *(str(number) for number in range(1, len(names) + 1))):
        raise MaterialError(f"'{target.name}' has no slot '{slot}'; it has {listed}")
    if not slot and len(names) > 1:
        raise MaterialError(f"'{target.name}' has several slots: name one by --slot: {listed}")
    if not names:
        target.data.materials.append(None)
    number = names.index(slot) if slot in names else int(slot or 1) - 1
    chosen = target.material_slots[number]
    if target.data.users > 1:
        chosen.link = "OBJECT"
    chosen.material = material


def read_folder(folder: Path, shared: Path | None = None) -> dict[str, Any]:
    """Return the document of an exported folder, with absolute paths of its files.

    shared : folder of the textures, if they lie elsewhere.

    Raises a MaterialError if the folder is not one, or names files elsewhere.
    """
    documents = sorted(
        file
        for file in folder.glob("*.json")
        if _is_own(file) and _is_own(file.with_suffix(".osl"))
    )
    if len(documents) != 1:
        raise MaterialError(
            f"expected one shader (.osl with .json) in '{folder}', got {len(documents)}; name the "
            "folder that 'mitsuba-diffraction export-osl' wrote"
        )
    try:
        exported = json.loads(documents[0].read_text(encoding="utf-8"))
        exported["shader"] = _file(folder, exported["shader"], ".osl")
        exported["textures"] = {
            key: _file(shared or folder, name, ".exr") for key, name in exported["textures"].items()
        }
        inputs = [(entry["identifier"], entry["label"]) for entry in exported["inputs"]]
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise MaterialError(
            f"cannot read '{documents[0]}' ({error}); export the shader again"
        ) from error
    files = [exported["shader"], *exported["textures"].values()]
    if not inputs or not all(map(_is_own, files)):
        raise MaterialError(
            f"'{folder}' is incomplete, or has links in place of files; export the shader again"
        )
    return dict(exported)


def _file(folder: Path, name: str, suffix: str) -> Path:
    """Return the path of a file that the document names; only names in its folder are allowed."""
    if Path(name).name != name or Path(name).suffix != suffix:
        raise ValueError(f"{name!r} is not the name of a file *{suffix} in this folder")
    return folder.resolve() / name


def _is_own(file: Path) -> bool:
    """Return whether a path is a regular file, and no link to one elsewhere."""
    return file.is_file() and not file.is_symlink()


def own_data(blocks: Any, name: str, shader: Path, *kind: str) -> Any:
    """Return the data block that an exported shader made under a name, or a new one.

    blocks : materials or node groups of the file; kind : further arguments of a new one.
    """
    for block in blocks:
        made_by = block.get(_SHADER)
        known = made_by is not None and block.get(_NAME) == name
        if known and (made_by == str(shader) or not Path(made_by).exists()):
            break
    else:
        block = blocks.new(name, *kind)
    block[_SHADER], block[_NAME] = str(shader), name
    return block


def _group(exported: dict[str, Any], name: str) -> Any:
    """Return the node group around a script node, with an input for each that artists set."""
    group = own_data(bpy.data.node_groups, name, exported["shader"], "ShaderNodeTree")
    group.nodes.clear()
    group.interface.clear()
    shader = exported["shader"]
    script = _node(group.nodes, "ShaderNodeScript", (0, 0))
    script.mode, script.label, script.width = "EXTERNAL", shader.name, 240
    _find_oslquery()
    script.filepath = str(shader)  # compiles, and makes the sockets
    if not script.outputs:
        raise MaterialError(f"Blender could not compile '{shader}'; its console says why")
    inside = _node(group.nodes, "NodeGroupInput", (-280, 0))
    outside = _node(group.nodes, "NodeGroupOutput", (320, 0))
    fixed = {key: str(file) for key, file in exported["textures"].items()}
    fixed["WorkingSpace"] = bpy.data.colorspace.working_space
    for entry in exported["inputs"]:
        socket = script.inputs[entry["label"]]
        if entry["identifier"] in fixed:
            socket.default_value = fixed[entry["identifier"]]
        else:
            outer = group.interface.new_socket(
                entry["label"], in_out="INPUT", socket_type=socket.bl_idname
            )
            _describe(outer, socket, entry)
            group.links.new(inside.outputs[entry["label"]], socket)
    group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    group.links.new(script.outputs[0], outside.inputs["BSDF"])
    return group


def _find_oslquery() -> None:
    """Let Python find `oslquery`, which the package bpy brings but does not put on the path."""
    version = "python{}.{}".format(*sys.version_info[:2])
    site = Path(bpy.utils.resource_path("LOCAL"), "python/lib", version, "site-packages")
    if site.is_dir() and str(site) not in sys.path:
        sys.path.append(str(site))


def _describe(outer: Any, socket: Any, entry: dict[str, Any]) -> None:
    """Give an input of a group the default and tooltip of its parameter."""
    outer.description = entry["help"]
    outer.hide_value = socket.hide_value
    if entry.get("kind") == "color":
        colour = mathutils.Color(entry["default"]).from_rec709_linear_to_scene_linear()
        outer.default_value = (*colour, 1.0)
    elif not socket.hide_value:
        outer.default_value = socket.default_value


def _link_tangent(nodes: Any, links: Any, surface: Any, tangent: str) -> None:
    """Link a Tangent node, whose direction an artist can change, to a group that takes it."""
    if "Tangent" in surface.inputs:
        node = _node(nodes, "ShaderNodeTangent", (-240, -120))
        node.direction_type, node.axis = TANGENTS[tangent]
        links.new(node.outputs[0], surface.inputs["Tangent"])


def _link_hologram(nodes: Any, links: Any, surface: Any, orientation: Any, stretch: Any) -> None:
    """Link pictures of a hologram to the inputs of a group."""

    def channels_of(file: Any, height: float) -> Any:
        channels = _node(nodes, "ShaderNodeSeparateColor", (-700, height))
        links.new(_picture(nodes, file, (-1000, height)).outputs["Color"], channels.inputs[0])
        return channels.outputs

    if orientation is not None:
        cosine, sine, _ = channels_of(orientation, 200)
        angle, degrees = (_node(nodes, "ShaderNodeMath", (x, 200)) for x in (-520, -360))
        angle.operation, degrees.operation = "ARCTAN2", "DEGREES"
        links.new(sine, angle.inputs[0])
        links.new(cosine, angle.inputs[1])
        links.new(angle.outputs[0], degrees.inputs[0])
        links.new(degrees.outputs[0], surface.inputs["Rotation (°)"])
    if stretch is not None:
        if "Stretch" not in surface.inputs:
            raise MaterialError(
                "solved orders cannot be stretched; export a patch of heights for --stretch"
            )
        links.new(channels_of(stretch, -320)[0], surface.inputs["Stretch"])


def _masked(nodes: Any, links: Any, surface: Any, weight: Any) -> Any:
    """Return a mix of plain metal and a group, by a picture of the group's share."""
    mix = _node(nodes, "ShaderNodeMixShader", (320, 0))
    blank = _node(nodes, "ShaderNodeBsdfAnisotropic", (60, 300))
    blank.inputs["Roughness"].default_value = 0.25  # of the slopes: α = 0.06
    blank.inputs["Color"].default_value = (0.9, 0.9, 0.9, 1.0)
    links.new(_picture(nodes, weight, (-300, 400)).outputs["Color"], mix.inputs[0])
    links.new(blank.outputs[0], mix.inputs[1])
    links.new(surface.outputs[0], mix.inputs[2])
    return mix


def _picture(nodes: Any, file: Any, location: tuple[float, float]) -> Any:
    """Return a node of a picture whose texels are numbers and are not interpolated."""
    with _naming(f"cannot read the picture '{file}'"):
        image = bpy.data.images.load(str(Path(file).resolve()), check_existing=True)
    image.colorspace_settings.name = "Non-Color"
    node = _node(nodes, "ShaderNodeTexImage", location)
    node.image, node.interpolation = image, "Closest"
    return node


@contextmanager
def _naming(text: str) -> Iterator[None]:
    """Raise a MaterialError of this text, with Blender's reason, where Blender refuses a file."""
    try:
        yield
    except RuntimeError as error:
        reason = str(error).strip().splitlines()[0].removeprefix("Error: ")
        raise MaterialError(f"{text}: {reason}") from error


def _node(nodes: Any, kind: str, location: tuple[float, float]) -> Any:
    node = nodes.new(kind)
    node.location = location
    return node


def _folders() -> list[Path]:
    """Return where the shader may be: FOLDER, beside this file, beside texts of the .blend."""
    if FOLDER:
        return [Path(FOLDER)]
    texts = [bpy.path.abspath(text.filepath) for text in bpy.data.texts if text.filepath]
    return [Path(file).parent for file in (__file__, *texts)]


def _arguments(words: Sequence[str]) -> argparse.Namespace:
    """Parse the command line, of which Blender's part ends with `--`."""
    parser = argparse.ArgumentParser(prog="blender_material.py", description=__doc__.split("\n")[0])
    parser.add_argument("--folder", type=Path, help="exported folder; default: of this script")
    parser.add_argument("--name", default="", help="of the material; default: the shader's name")
    parser.add_argument("--object", help="mesh object that gets the material")
    parser.add_argument("--slot", default="", help="its slot, by material or number from 1")
    parser.add_argument(
        "--tangent", choices=TANGENTS, default="uv", help="direction of the patch's x axis"
    )
    pictures = {
        "orientation": "cosine and sine of the angle", "stretch": "factor on lengths",
        "weight": "share of the patch",
    }  # fmt: skip
    for key, content in pictures.items():
        parser.add_argument(f"--{key}", type=Path, help=f"picture of a hologram: {content}")
    parser.add_argument("--working-space", help="working space of the file; default: as it is")
    parser.add_argument("--blend", type=Path, help=".blend file to add to; default: the open one")
    parser.add_argument(
        "--output",
        type=Path,
        help=".blend file to write; default: beside --blend, with _diffraction in its name",
    )
    return parser.parse_args(words)


def run(words: Sequence[str]) -> None:
    """Add the material to the open file as the command line says."""
    arguments = _arguments(words)
    check_blender()
    output = _output(arguments)
    if arguments.blend:
        with _naming(f"cannot open '{arguments.blend}'"):
            bpy.ops.wm.open_mainfile(filepath=str(arguments.blend.resolve()), load_ui=False)
    if arguments.working_space:
        _set_working_space(arguments.working_space)
    folders = [arguments.folder] if arguments.folder else _folders()
    folder = next((path for path in folders if any(path.glob("*.osl"))), folders[0])
    material = add_material(
        folder, name=arguments.name, tangent=arguments.tangent,
        orientation=arguments.orientation, stretch=arguments.stretch, weight=arguments.weight,
    )  # fmt: skip
    if arguments.object:
        target = bpy.data.objects.get(arguments.object)
        if target is None or target.type != "MESH":
            meshes = ", ".join(o.name for o in bpy.data.objects if o.type == "MESH") or "none"
            raise MaterialError(f"no mesh object '{arguments.object}'; the file has {meshes}")
        give_material(target, material, arguments.slot)
    else:
        material.use_fake_user = True  # kept in the file while no object has it
    if output:
        if not output.parent.is_dir():
            raise MaterialError(f"cannot write '{output}': its folder does not exist")
        with _naming(f"cannot write '{output}'"):
            bpy.ops.wm.save_as_mainfile(filepath=str(output.resolve()), check_existing=False)
    print(
        f"added the material '{material.name}' of {folder}" + (f", in {output}" if output else "")
    )


def _output(arguments: argparse.Namespace) -> Path | None:
    """Return the file to write; None leaves it to the user of Blender's window."""
    if arguments.slot and not arguments.object:
        raise MaterialError("--slot is of an object: name it by --object")
    if arguments.output:
        return Path(arguments.output)
    file: Path = arguments.blend or Path(bpy.data.filepath)
    if not (arguments.blend or bpy.app.background):
        return None
    if not file.name:
        raise MaterialError("nothing would be saved: name a file by --output, or by --blend")
    copy = file.with_name(f"{file.stem}_diffraction.blend")
    if copy.exists():
        raise MaterialError(f"'{copy}' is there already: name a file by --output, it or another")
    return copy


def _set_working_space(name: str) -> None:
    """Set the working space of the open file, and convert its colours."""
    try:
        bpy.ops.wm.set_working_color_space(working_space=name)
    except TypeError as error:  # the message lists the names
        names = str(error).rpartition(" not found in ")[2] or "the names in Blender's panel"
        raise MaterialError(f"working space '{name}' is unknown; choose one of {names}") from error
    for group in bpy.data.node_groups:
        if _SHADER in group:
            for node in (n for n in group.nodes if n.type == "SCRIPT"):
                node.inputs["Working Space"].default_value = name


def main() -> None:
    """Run, and report an error in one line: in a popup of Blender's window, or on stderr."""
    words = sys.argv[1:]
    if os.path.basename(sys.argv[0]) != os.path.basename(__file__):  # Blender's own words
        words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    try:
        run(words)
    except MaterialError as error:
        message = f"blender_material.py: error: {error}"
        print(message, file=sys.stderr)
        if bpy is None or bpy.app.background:
            sys.exit(1)
        bpy.context.window_manager.popup_menu(
            lambda menu, _: menu.layout.label(text=message), title="Material", icon="ERROR"
        )


if __name__ == "__main__":
    main()
