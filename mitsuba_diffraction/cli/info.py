"""`mitsuba-diffraction info`: summary of a file."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from ..errors import DiffractionError
from ..files import GLTF, MESHES, FileKind
from ..gltf import materials_of
from ..heights import HeightField, Source, jumping_lines
from ..heights.coherence import resolved, width_reason
from ..heights.formats.catalogue import sections
from ..heights.spectra import LEAST_SHARE, examine_periods
from ..images import save_figure
from ..settings import TableSettings
from ..tables import DiffractionTable
from . import options
from .console import Bar, flagged
from .report import STDOUT, Figures, lines_of, plain
from .values import path_ending_in

# What `render MESH` and `tangents` do with a mesh without normals
_SMOOTH = "none in the file; render MESH and tangents make smooth ones; sharp UV edges stay"
#: Settings of a table that its warnings depend on.
_TABLE = ("coherence_width", "wavelength_range")


_PLOT = path_ending_in(".png", ".pdf", ".svg")


@options.command(
    "info", "describe a table, a height field, a recipe or a mesh",
    "Describe a table, a table of orders, a file of heights, a recipe, or a mesh (PLY, OBJ, "
    "glTF, USD, serialized) and whether its tangents suit a measured patch.",
    ("FILE", "table, table of orders, heights, recipe or mesh", Path, None, {"nargs": "?"}),
    options.json("the description", nargs="?", const=STDOUT),
    ("--formats", "list the formats of scans: what is read, from which instruments, and what "
     "to export in place of others", bool),
    ("--albedo OUT", "plot a table's raw directional albedo against angle and azimuth", _PLOT),
    ("--energy", "a table's albedo for three materials, raw and conserved, and R + T of a "
     "dielectric and of a thin sheet", bool),
    ("--picture OUT", "draw heights or a recipe's: the patch, its distribution and spectrum, "
     "and the light that it scatters", _PLOT),
    options.heights(),
    options.Group("the table", tuple(options.table(_TABLE))),
)  # fmt: skip
def run(args: argparse.Namespace) -> Figures:
    """Print the description, and return the figures."""
    if args.formats:
        options.refuse_others(args, ["formats"], " with --formats, which is about no file")
        return _formats(args)
    if args.file is None:
        args.parser.error("name a file, or give --formats")
    source = Source.of(args.file, options.load_options(args))
    others = FileKind.TABLE, FileKind.ORDERS, FileKind.MESH, FileKind.SCENE
    if source.kind not in others:
        with Bar(args) as bar:
            bar(0, 0, "reading heights")
            source = source.read()
    data = {"file": str(args.file), **_describe(source, args)}
    for name, kinds, what in (
        ("energy", ("table",), "a table"),
        ("albedo", ("table",), "a table"),
        ("picture", ("height field", "recipe"), "heights"),
    ):
        if data["kind"] not in kinds:
            options.refuse(args, [name], f": '{args.file}' is a {data['kind']}, not {what}")
    if args.energy or args.albedo is not None:
        from ..analysis.energy import energy_summary, energy_warnings, sides_summary
        from ..analysis.pictures import albedo_figure

        table = DiffractionTable.load(args.file)
    if args.energy:
        energy = energy_summary(table)
        data |= {"energy": energy, "both sides": sides_summary(table)}
        data["warnings"] = energy_warnings(energy)
    if args.albedo is not None:
        save_figure(args.albedo, albedo_figure(table), dpi=100)
        data["albedo plot"] = str(args.albedo)
    if args.picture is not None:
        from ..analysis.pictures import patches_figure

        save_figure(args.picture, patches_figure(source.fields()), dpi=80)
        data["picture"] = str(args.picture)
    if "warnings" in data:
        data["warnings"] = list(map(flagged, data["warnings"]))
    if args.json == STDOUT:
        print(json.dumps(plain(data), indent=2, ensure_ascii=False, allow_nan=False))
    else:
        print("\n".join(lines_of(data)))
    return data


def _formats(args: argparse.Namespace) -> Figures:
    """Print the formats of scans, and return the figures."""
    data = sections()
    if args.json == STDOUT:
        print(json.dumps(data, indent=2, ensure_ascii=False))
        return data
    for title, rows in data.items():
        print(f"{title}:")
        for row in rows:
            name, suffixes, makers, last = row.values()
            what = list(row)[-1]
            end = "" if last == "none" else f"; {what}: {last}"
            print(f"  {name} ({suffixes}): {makers}{end}")
    return data


def _describe(source: Source, args: argparse.Namespace) -> dict[str, Any]:
    file, kind = args.file, source.kind
    if kind is FileKind.SCENE:
        raise DiffractionError(
            f"'{file}' is a scene, which `mitsuba-diffraction render` renders; info describes what "
            "a scene names: tables, heights (images, NPY, text, instrument files), recipes (TOML) "
            f"and meshes ({', '.join(MESHES)})"
        )
    if kind not in (FileKind.TABLE, FileKind.ORDERS, FileKind.MESH):
        return _heights(source, args)
    options.refuse(args, (*options.HEIGHTS, *_TABLE), f": '{file}' is a {kind}, not heights")
    if kind is FileKind.MESH:
        return _mesh(file)
    from ..orders.file import load_orders

    load: Any = DiffractionTable.load if kind is FileKind.TABLE else load_orders
    return {"kind": str(kind), **load(file).summary()}


def _heights(source: Source, args: argparse.Namespace) -> dict[str, Any]:
    """Describe a file of heights, or a recipe."""
    fields = source.fields()
    settings = TableSettings(**{**source.settings, **options.table_options(args)})
    patches = [{**field.summary(), **_periods(field)} for field in fields]
    window = width_reason(resolved(settings, fields), fields)
    warnings = options.table_warnings(fields, settings)
    if source.kind is not FileKind.RECIPE:
        warnings += filter(None, [jumping_lines(fields[0])])
        return {"kind": "height field", **patches[0], "window": window, "warnings": warnings,
                "limits": options.LIMITS}  # fmt: skip
    return {
        "kind": "recipe",
        **({"generator": source.generator} if source.generator else {}),
        "options": source.options.specified(),
        "table": source.settings,
        "output": str(source.output),
        "output exists": source.output.is_file(),
        "patches": patches,
        "window": window,
        "warnings": warnings,
    }


def _periods(field: HeightField) -> dict[str, Any]:
    """Return the gratings of the patch, and a structure that is too weak for one, if any."""
    gratings, weak = examine_periods(field)
    described: dict[str, Any] = {"periods": [str(grating) for grating in gratings] or ["none"]}
    if weak is not None:
        described["weak period"] = f"{weak}, below the {LEAST_SHARE:.0%} of a grating"
    return described


def _mesh(file: Path) -> dict[str, Any]:
    from ..scene.fitted_mesh import fit_of
    from ..scene.orientation.mesh_files import load_mesh
    from ..scene.orientation.tangents import check_tangents

    mesh = load_mesh(file)
    report = check_tangents(mesh)
    materials = {}
    if file.suffix.lower() in GLTF:  # names that --preset and --assign take
        materials["materials"] = [each.name for each in materials_of(file)] or ["none"]
    try:
        fit: Any = fit_of(mesh, file).summary()
    except DiffractionError as error:
        fit = f"none: {error}"
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    return {
        "kind": "mesh",
        "bounding box, x y z": [f"{a:.4g} to {b:.4g}" for a, b in zip(low, high, strict=True)],
        **report.summary(),
        **materials,
        "normals": "in the file" if mesh.own_normals else _SMOOTH,
        "fit of render MESH --patch FILE": fit,
    }
