"""`export-osl`: a surface as a shader for Blender's Cycles."""

from __future__ import annotations

import argparse
import re
import tempfile
from pathlib import Path

import mitsuba as mi

from ..errors import DiffractionError
from ..plugin.presets import presets
from ..scene import set_variant
from . import options
from .brdf_map import SURFACE_SOURCE, surface_bsdf, surface_options, take_source
from .console import Bar, say_warning
from .report import Figures, check_outputs, elapsed, output_of
from .values import path_ending_in


@options.command(
    "export-osl", "write a surface as a shader for Blender's Cycles (OSL)",
    "Write a shader in Open Shading Language with its textures (EXR), and a script that adds "
    "the material to a .blend file: docs/blender.md. With --addon, pack exported surfaces, or "
    "all presets, as an add-on that Blender installs.",
    *SURFACE_SOURCE,
    ("--addon ZIP", "write this add-on for Blender, with a panel and an asset library, and no "
     "folder; without SOURCE and --preset it has all presets that the shaders show",
     path_ending_in(".zip")),
    ("--with FOLDER", "exported folder that the add-on has, too; may be given several times",
     [Path], None, {"dest": "folders"}),
    ("-o --output FOLDER", "to write into, made if it is missing; default: SOURCE's name with "
     "-osl in the current folder", Path),
    ("--name NAME", "name of the shader and its files; default: diffraction_ and SOURCE's "
     "name"),
    options.MODE,
    surface_options(),
    options.heights(),
    options.json("the files and their settings"),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Export, and return the figures."""
    if args.addon is not None:
        return _addon(args)
    options.refuse(args, ["folders"], ": is for --addon")
    take_source(args)
    look = args.preset or args.source.stem
    name = args.name or "diffraction_" + re.sub(r"[^A-Za-z0-9_]", "_", look)

    def files_in(folder: Path) -> list[Path]:
        return [folder / f"{name}{suffix}" for suffix in (".osl", ".json")]

    from ..osl import check_name, export

    check_name(name)  # before the folder and the tables are made
    folder = output_of(args, Path(f"{look}-osl"), files_in, make_folder=True)
    set_variant(args.mode)
    with Bar(args) as bar:
        bar(0, 0, "making tables")
        exported = export(surface_bsdf(args), folder, name)
    files = [exported.shader, exported.document, *exported.textures.values()]
    error = ", ".join(f"{key} {value:.2g}" for key, value in exported.error.items())
    size = sum(file.stat().st_size for file in files)
    print(
        f"{exported.shader}: {size / 1e6:.1f} MB with textures, "
        f"{elapsed(args):.1f} s; {exported.surface}; error of the textures, as a "
        f"share of the light: {error}"
    )
    return {"source": args.source, "folder": folder, "files": files,
            "surface": exported.surface, "error": exported.error,
            "bytes": size}  # fmt: skip


def _addon(args: argparse.Namespace) -> Figures:
    """Pack the add-on, and return the figures."""
    options.refuse_others(
        args, ["addon", "folders" if args.folders else "mode"],
        ": not allowed with argument --addon; export the surface into a folder first, and name it "
        "by --with",
    )  # fmt: skip
    check_outputs([args.addon])

    from ..osl import make_addon

    folders = {folder.resolve().name.removesuffix("-osl"): folder for folder in args.folders}
    with tempfile.TemporaryDirectory() as temporary:
        if not folders:
            folders = _exported_looks(args, Path(temporary))
        make_addon(folders, args.addon)
    size = args.addon.stat().st_size
    print(f"{args.addon}: {', '.join(folders)}: {size / 1e6:.1f} MB, {elapsed(args):.1f} s")
    return {"files": [args.addon], "looks": list(folders), "bytes": size}


def _exported_looks(args: argparse.Namespace, folder: Path) -> dict[str, Path]:
    """Export all presets that the shaders show; say in a line which they do not."""
    from ..osl import export

    set_variant(args.mode)
    folders = {}
    with Bar(args) as bar:
        for done, preset in enumerate(presets().values()):
            bar(done, len(presets()), preset.name)
            name = preset.name.replace("-", "_") + "_look"
            try:
                export(mi.load_dict(preset.changed({})), folder / preset.name, name)
            except DiffractionError as error:
                say_warning(f"the add-on goes without '{preset.name}': {error}")
            else:
                folders[preset.name] = folder / preset.name
    return folders
