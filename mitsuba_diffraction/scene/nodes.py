"""Checks of a parsed scene, before Mitsuba makes objects of its nodes and reads their files."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import Any

import mitsuba as mi
import OpenEXR

from ..files import FileKind, kind_of, readable_file, refuse_pipe
from ..images import open_image
from ..limits import MOST_NESTED, check_content, check_count, tree_sizes
from ..streams import without_chatter
from .orientation.mesh_indices import check_mesh
from .surfaces import targets_of

# Mitsuba's plugins that read a picture
_PICTURES = ("bitmap", "envmap")
_MESHES = ("ply", "obj", "serialized")


def check_nodes(state: Any) -> None:
    """Refuse files that Mitsuba cannot read safely, and BSDFs that nest too much.

    state : `mi.parser.ParserState`, its references resolved.

    Raises a DiffractionError that names the file or BSDF.
    """
    for node in state.nodes:
        props = node.props
        # a property that is read counts as read by the plugin, which reads these
        if "filename" not in props or props.type("filename") != mi.Properties.Type.String:
            continue
        file = Path(str(mi.file_resolver().resolve(props["filename"])))
        refuse_pipe(file)
        if not file.is_file():
            continue  # Mitsuba says so
        kind = props.plugin_name()
        if kind in _MESHES:
            number = props.get("shape_index", 0) if kind == "serialized" else 0
            check_mesh(readable_file(file), kind, number if isinstance(number, int) else 0)
        elif kind in _PICTURES:
            _check_pixels(readable_file(file))
    _check_nesting(state)


def _check_pixels(file: Path) -> None:
    """Refuse a small picture of many pixels; Mitsuba refuses damaged ones."""
    if kind_of(file) in (FileKind.EXR, FileKind.TABLE):
        with contextlib.suppress(RuntimeError, OSError, LookupError, TypeError):
            with without_chatter():
                parts = OpenEXR.File(str(file), header_only=True).parts
            for part in parts:
                low, high = part.header["dataWindow"]
                width, height = (float(b) - float(a) + 1.0 for a, b in zip(low, high, strict=True))
                claimed = 4.0 * width * height * len(part.header["channels"])
                check_content(claimed, file.stat().st_size, f"'{file}'")
        return
    with contextlib.suppress(OSError, SyntaxError):
        open_image(file).close()


def _check_nesting(state: Any) -> None:
    """Refuse BSDFs whose references, written out as a tree, have too many nodes.

    Descriptions of BSDFs (`str`) are such trees: 20 blends of the one before are a million nodes.
    """
    sizes = tree_sizes([list(targets_of(node).values()) for node in state.nodes])
    for number, node in enumerate(state.nodes):
        if node.type == mi.ObjectType.BSDF:
            shown = f"BSDF {node.props.id() or node.props.plugin_name()!r}"
            check_count(sizes[number], MOST_NESTED, shown, "BSDFs and textures within it")
