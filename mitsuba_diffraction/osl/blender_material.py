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
    if "Tangent" in surface.inputs:  # of a node, whose direction an artist can change
        node = _node(nodes, "ShaderNodeTangent", (-240, -120))
        node.direction_type, node.axis = TANGENTS[tangent]
        links.new(node.outputs[0], surface.inputs["Tangent"])
    last = _hologram(nodes, links, surface, orientation, stretch, weight)
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
        oldest = ".".join(map(str, OLDEST))
        raise MaterialError(
            f"Blender {bpy.app.version_string} is too old; the shader needs {oldest} or newer"
        )
    try:
        from _cycles import with_osl
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
    numbers = [str(number) for number in range(1, len(names) + 1)]
    listed = ", ".join(map(" ".join, zip(numbers, names, strict=True))) or "none"
    if slot and slot not in (*names, *numbers):
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
    pairs = [(file, file.with_suffix(".osl")) for file in folder.glob("*.json")]
    documents = [pair[0] for pair in pairs if all(map(_is_own, pair))]
    if len(documents) != 1:
        raise MaterialError(
            f"expected one shader (.osl with .json) in '{folder}', got {len(documents)}; name the "
            "folder that 'mitsuba-diffraction export-osl' wrote"
        )

    def named(where: Path, name: str, suffix: str) -> Path:
        """Return the path of a file that the document names, without any folder."""
        if Path(name).name != name or Path(name).suffix != suffix:
            raise ValueError(f"{name!r} is not the name of a file *{suffix} in this folder")
        return where.resolve() / name

    try:
        exported = dict(json.loads(documents[0].read_text(encoding="utf-8")))
        exported["shader"] = named(folder, exported["shader"], ".osl")
        textures = exported["textures"].items()
        exported["textures"] = {key: named(shared or folder, n, ".exr") for key, n in textures}
        inputs = [(entry["identifier"], entry["label"]) for entry in exported["inputs"]]
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        message = f"cannot read '{documents[0]}' ({error}); export the shader again"
        raise MaterialError(message) from error
    files = [exported["shader"], *exported["textures"].values()]
    if not inputs or not all(map(_is_own, files)):
        raise MaterialError(
            f"'{folder}' is incomplete, or has links in place of files; export the shader again"
        )
    return exported


def _is_own(file: Path) -> bool:
    """Return whether a path is a regular file, and no link to one elsewhere."""
    return file.is_file() and not file.is_symlink()


def own_data(blocks: Any, name: str, shader: Path, *kind: str) -> Any:
    """Return the data block that an exported shader made under a name, or a new one.

    blocks : materials or node groups of the file; kind : further arguments of a new one.
    """
    named = [block for block in blocks if block.get(_SHADER) and block.get(_NAME) == name]
    own = (b for b in named if b[_SHADER] == str(shader) or not Path(b[_SHADER]).exists())
    block = next(own, None) or blocks.new(name, *kind)
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
    # the package bpy brings `oslquery`, but does not put it on the path
    version = "python{}.{}".format(*sys.version_info[:2])
    site = Path(bpy.utils.resource_path("LOCAL"), "python/lib", version, "site-packages")
    if site.is_dir() and str(site) not in sys.path:
        sys.path.append(str(site))
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
            outer.description, outer.hide_value = entry["help"], socket.hide_value
            if entry.get("kind") == "color":
                colour = mathutils.Color(entry["default"]).from_rec709_linear_to_scene_linear()
                outer.default_value = (*colour, 1.0)
            elif not socket.hide_value:
                outer.default_value = socket.default_value
            group.links.new(inside.outputs[entry["label"]], socket)
    group.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
    group.links.new(script.outputs[0], outside.inputs["BSDF"])
    return group


def _hologram(
    nodes: Any, links: Any, surface: Any, orientation: Any, stretch: Any, weight: Any
) -> Any:
    """Link pictures of a hologram to the inputs of a group, and return the node of the whole.

    By a picture of its share, the group is mixed with plain metal.
    """

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
            remedy = "export a patch of heights for --stretch"
            raise MaterialError(f"solved orders cannot be stretched; {remedy}")
        links.new(channels_of(stretch, -320)[0], surface.inputs["Stretch"])
    if weight is None:
        return surface
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


def _arguments(words: Sequence[str]) -> argparse.Namespace:
    """Parse the command line, of which Blender's part ends with `--`."""
    parser = argparse.ArgumentParser(prog="blender_material.py", description=__doc__.split("\n")[0])
    parser.add_argument("--folder", type=Path, help="exported folder; default: of this script")
    parser.add_argument("--name", default="", help="of the material; default: the shader's name")
    parser.add_argument("--object", help="mesh object that gets the material")
    parser.add_argument("--slot", default="", help="its slot, by material or number from 1")
    along = "direction of the patch's x axis"
    parser.add_argument("--tangent", choices=TANGENTS, default="uv", help=along)
    picture = "picture of a hologram: "
    parser.add_argument("--orientation", type=Path, help=f"{picture}cosine and sine of the angle")
    parser.add_argument("--stretch", type=Path, help=f"{picture}factor on lengths")
    parser.add_argument("--weight", type=Path, help=f"{picture}share of the patch")
    parser.add_argument("--working-space", help="working space of the file; default: as it is")
    parser.add_argument("--blend", type=Path, help=".blend file to add to; default: the open one")
    written = ".blend file to write; default: beside --blend, with _diffraction in its name"
    parser.add_argument("--output", type=Path, help=written)
    return parser.parse_args(words)


def run(words: Sequence[str]) -> None:
    """Add the material to the open file as the command line says."""
    arguments = _arguments(words)
    check_blender()
    output = _output(arguments)
    if arguments.blend:
        with _naming(f"cannot open '{arguments.blend}'"):
            bpy.ops.wm.open_mainfile(filepath=str(arguments.blend.resolve()), load_ui=False)
    if name := arguments.working_space:
        try:
            bpy.ops.wm.set_working_color_space(working_space=name)
        except TypeError as error:  # the message lists the names
            names = str(error).rpartition(" not found in ")[2] or "the names in Blender's panel"
            message = f"working space '{name}' is unknown; choose one of {names}"
            raise MaterialError(message) from error
        for node in (n for g in bpy.data.node_groups if _SHADER in g for n in g.nodes):
            if node.type == "SCRIPT":
                node.inputs["Working Space"].default_value = name
    folder = arguments.folder or (Path(FOLDER) if FOLDER else None)
    if folder is None:  # beside this file, or beside texts of the .blend
        texts = [bpy.path.abspath(text.filepath) for text in bpy.data.texts if text.filepath]
        beside = [Path(file).parent for file in (__file__, *texts)]
        folder = next((path for path in beside if any(path.glob("*.osl"))), beside[0])
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
    place = f", in {output}" if output else ""
    print(f"added the material '{material.name}' of {folder}{place}")


def _output(arguments: argparse.Namespace) -> Path | None:
    """Return the file to write; None leaves it to the user of Blender's window."""
    if arguments.slot and not arguments.object:
        raise MaterialError("--slot is of an object: name it by --object")
    output: Path | None = arguments.output
    if output or not (arguments.blend or bpy.app.background):
        return output
    file: Path = arguments.blend or Path(bpy.data.filepath)
    if not file.name:
        raise MaterialError("nothing would be saved: name a file by --output, or by --blend")
    copy = file.with_name(f"{file.stem}_diffraction.blend")
    if copy.exists():
        raise MaterialError(f"'{copy}' is there already: name a file by --output, it or another")
    return copy


def main() -> None:
    """Run, and report an error in one line: in a popup of Blender's window, or on stderr."""
    words = sys.argv[1:]
    if os.path.basename(sys.argv[0]) != os.path.basename(__file__):  # Blender's own words
        words = sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []
    try:
        run(words)
    except MaterialError as error:
        print(message := f"blender_material.py: error: {error}", file=sys.stderr)
        if bpy is None or bpy.app.background:
            sys.exit(1)
        bpy.context.window_manager.popup_menu(
            lambda menu, _: menu.layout.label(text=message), title="Material", icon="ERROR"
        )


if __name__ == "__main__":
    main()
