"""The scene of a command, or a mesh on a stage, with parameters and materials; its rendering.

`SCENE` has the options, `scene_parameters` reads their values, and `put_on_stage` puts a mesh in
place of a scene into the studio.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from ..errors import DiffractionError
from ..files import MESHES, OTHER_MESHES, FileKind, kind_of, readable_file
from ..plugin.parameters import NAMES, REFLECTING
from ..scene.parameters import MATERIAL
from ..scene.stage import STUDIO
from .options import MODE
from .values import pair, whole_number

#: Id of the BSDF of a scene's patch: of the studio, the material ball, plate, sphere and scales.
SURFACE = "surface"


#: A scene, its parameters, variant and sensor.
SCENE = (
    ("SCENE", "Mitsuba XML file; or, with --patch, a mesh (PLY, OBJ, glTF, USD) for the studio",
     Path),
    ("--patch FILE", "surface of a mesh: heights, recipe or table; pixel_size, max_height, "
     "material, up, turn and the lamp are set by -D", Path),
    ("--preset [ID=]NAME[,NAME=VALUE...]", "preset instead of --patch, e.g. cd or "
     "snake,height_scale=0.7; for the BSDF or shape of this id, or the material of a glTF mesh; "
     "default of ID: surface", [str], None, {"dest": "presets"}),
    ("--assign ID=FILE[,NAME=VALUE...]", "surface on the BSDF or shape of this id, or the material "
     "of a glTF mesh, e.g. mat-Skin=scale.exr,int_ior=1.56; may be given several times",
     [pair("KEY=VALUE", empty=True)], None, {"dest": "materials"}),
    MODE,
    ("-D --define KEY=VALUE", "set a parameter of the scene; may be given several times",
     [pair("KEY=VALUE", empty=True)], None, {"dest": "parameters"}),
    ("--sensor N", "number of the sensor, from 0", whole_number(0), 0),
)  # fmt: skip


def scene_parameters(args: argparse.Namespace) -> dict[str, str]:
    """Return the values of -D, --assign and --preset, as `load_scene` takes them.

    A value given twice is a usage error. A mesh in place of a scene is put into the studio, with
    its surface, by `put_on_stage`.
    """
    from ..scene.surfaces import PRESET

    parameters = dict(args.parameters)
    if len(parameters) < len(args.parameters):
        twice = next(k for k in parameters if [n for n, _ in args.parameters].count(k) > 1)
        args.parser.error(f"argument -D: {twice!r} is set more than once")
    surfaces = list(args.materials)
    for text in args.presets:
        head, comma, changes = text.partition(",")
        look = head.rpartition("=")[2]
        surfaces.append((_id_of(text), f"{PRESET}{look}{comma}{changes}"))
    ids = [name for name, _ in surfaces]
    for name in ids:
        if ids.count(name) > 1:
            args.parser.error(f"argument --assign, --preset: {name!r} is given more than once")
    return parameters | {MATERIAL + name: value for name, value in surfaces}


def _id_of(preset: str) -> str:
    """Return the id of a value of --preset."""
    return preset.partition(",")[0].rpartition("=")[0] or SURFACE


def put_on_stage(args: argparse.Namespace) -> None:
    """Replace a mesh in place of the scene by the studio, with the mesh and its surface.

    The scene is then the studio, and default names of outputs follow the mesh: `args.name`.
    """
    args.name, suffix = args.scene, args.scene.suffix.lower()
    if suffix in OTHER_MESHES:
        raise DiffractionError(
            f"mesh '{args.scene}': Mitsuba does not read {suffix}; convert it to PLY or OBJ, as "
            "Blender's export does"
        )
    kind = kind_of(args.scene)
    # any other content may be a scene without a suffix
    scenes = FileKind.SCENE, FileKind.MESH, FileKind.INSTRUMENT
    if kind not in scenes and args.scene.is_file():
        raise DiffractionError(
            f"'{args.scene}' ({kind}) is neither a scene (XML) nor a mesh; put it on a mesh by "
            "--patch, on a surface of a scene by --assign, or look at it by 'brdf-map'"
        )
    if suffix not in MESHES:
        if args.patch is not None:
            args.parser.error(
                f"argument --patch: is for a mesh ({', '.join(MESHES)}); for '{args.scene}' use "
                "--assign ID=FILE"
            )
        return
    ids = [*map(_id_of, args.presets), *(name for name, _ in args.materials)]
    if args.patch is None and not ids:
        args.parser.error(
            f"'{args.scene}' is a mesh: say which surface it has, --patch FILE (heights, recipe "
            "or table) or --preset NAME"
        )
    if args.patch is not None and SURFACE in ids:
        args.parser.error(
            f"'{args.scene}' is given two surfaces, --patch {args.patch} and one by --preset or "
            "--assign; leave one out, or name the material that the second is for, ID="
        )
    args.parameters = [*args.parameters, ("mesh", str(readable_file(args.scene).absolute()))]
    if args.patch is not None:
        args.parameters = [*args.parameters, ("patch", str(readable_file(args.patch).absolute()))]
    else:
        _change_looks(args)
    if args.patch is None and SURFACE not in ids and "others" not in dict(args.parameters):
        args.parameters = [*args.parameters, ("others", "own")]
    args.scene = STUDIO


def _change_looks(args: argparse.Namespace) -> None:
    """Put parameters of the surface behind the looks in place of the studio's surface."""
    changes = "".join(f",{k}={v}" for k, v in args.parameters if k in NAMES[REFLECTING])
    args.parameters = [pair for pair in args.parameters if pair[0] not in NAMES[REFLECTING]]
    args.presets = [preset + changes for preset in args.presets]
    args.materials = [(name, file + changes) for name, file in args.materials]
