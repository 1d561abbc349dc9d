"""Mitsuba's own plugins and tables, before files of the same names beside a scene.

Mitsuba 3.9 looks for `plugins/TYPE.so` and `data/ior/…` in the folders of `<path>`, in the scene's
folder and in the current folder first, and in its own folder last: a plugin in a folder that was
downloaded with a scene would run. For a name that no folder has, it opens the file relative to the
current folder.
"""

from __future__ import annotations

import importlib
import re
from functools import cache
from pathlib import Path
from typing import Any

import mitsuba as mi

from ..errors import DiffractionError, quoted

#: BSDFs that this package registers.
REGISTERED = (
    "diffraction", "diffraction_dielectric", "diffraction_orders", "diffraction_mix",
    "diffraction_preset",
)  # fmt: skip
_NAME = re.compile(r"[A-Za-z0-9_-]+")
_LIBRARIES = (".so", ".dylib", ".dll")
# The plugin reads addresses in the memory of Blender's own process.
_BLENDER = "blender"


@cache
def folder() -> Path:
    """Return the folder of Mitsuba's plugins and data."""
    # Mitsuba appends its own folder to the search path last
    candidates = [Path(mi.__file__).parent, *map(_path, reversed(list(mi.file_resolver())))]
    return next(path for path in candidates if (path / "plugins").is_dir())


def search_first() -> None:
    """Put Mitsuba's own folder in front of all folders in which Mitsuba now looks for files."""
    mi.file_resolver().prepend(str(folder()))


def reserve_names() -> None:
    """Register the names of the package's BSDFs in `scalar_rgb`.

    `mi.load_dict` asks that variant for the type of a plugin, in whichever variant is set, and
    loads `plugins/NAME.so` of the current folder if it does not know the name.
    """
    variant = importlib.import_module("mitsuba.scalar_rgb")
    for name in REGISTERED:
        variant.register_bsdf(name, _unset)


def check_plugins(state: Any) -> None:
    """Refuse plugins that Mitsuba would load from a file beside the scene.

    state : `mi.parser.ParserState`, not yet instantiated.

    Raises a DiffractionError if a plugin's name is malformed, or its file lies elsewhere than in
    Mitsuba's folder.
    """
    known = {path.stem for path in (folder() / "plugins").iterdir()} - {_BLENDER}
    for name in dict.fromkeys(node.props.plugin_name() for node in state.nodes):
        if name in known or name in REGISTERED:
            continue
        if name == _BLENDER:
            raise DiffractionError(
                "plugin 'blender' reads the memory of Blender's process; export the mesh as PLY"
            )
        if not _NAME.fullmatch(name):
            raise DiffractionError(
                f"plugin {quoted(name)}: a plugin's name has letters, digits, - and _ only"
            )
        for suffix in _LIBRARIES:
            file = _path(mi.file_resolver().resolve(f"plugins/{name}{suffix}"))
            if file.exists() or file.is_symlink():
                raise DiffractionError(
                    f"plugin {name!r} would run '{file}', which is not Mitsuba's own; remove "
                    "that file, or install the plugin into Mitsuba's folder if you trust it"
                )


def _path(path: Any) -> Path:
    return Path(str(path))


def _unset(props: Any) -> Any:
    raise DiffractionError(
        f"{props.plugin_name()}: set the variant scalar_rgb by mi.set_variant first"
    )
