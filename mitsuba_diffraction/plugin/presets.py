"""Presets: a patch with its material and layers, one record each in `presets.toml`.

The BSDF plugin `diffraction_preset` and `preset` turn a record into the BSDF that it names.
"""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import mitsuba as mi

from ..errors import DiffractionError, quoted
from ..files import FileKind, kind_of
from .dictionary import ORDERS, PLUGINS
from .types import BSDF, Properties

# Wheels bring the patches along; a clone has them among its recipes.
_BROUGHT, _CLONE = Path(__file__).with_name("patches"), Path(__file__).parents[2] / "precompute"
PATCHES = _BROUGHT if _BROUGHT.is_dir() else _CLONE
#: Name of the plugin, and of its only parameter of its own.
PLUGIN, PARAMETER = "diffraction_preset", "preset"
#: Parameters of which one states the whole boundary: a change of one drops the others.
MATERIALS = ("material", "int_ior", "eta", "k")


@dataclass(frozen=True)
class Preset:
    """A preset.

    Attributes
    ----------
    name : as it is called on the command line.
    about : a line on the surface.
    patch : file of a recipe or of a table of orders.
    plugin : BSDF that shows it.
    parameters : parameters of the BSDF but the patch, by name.
    """

    name: str
    about: str
    patch: Path
    plugin: str
    parameters: Mapping[str, Any]

    def changed(self, changes: Mapping[str, Any]) -> dict[str, Any]:
        """Return the dictionary of the BSDF, with these parameters instead of the record's."""
        own = dict(self.parameters)
        if any(name in changes for name in MATERIALS):
            own = {name: value for name, value in own.items() if name not in MATERIALS}
        return {"type": self.plugin, "filename": str(self.patch), **own, **changes}


@cache
def presets() -> Mapping[str, Preset]:
    """Return all presets by name, in the order of the file."""
    content = tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))
    return {name: _of_record(name, dict(record)) for name, record in content.items()}


def _of_record(name: str, record: dict[str, Any]) -> Preset:
    patch = PATCHES / record.pop("patch")
    usual = ORDERS if kind_of(patch) is FileKind.ORDERS else PLUGINS[0]
    return Preset(name, record.pop("about"), patch, record.pop("plugin", usual), record)


def find_preset(name: str) -> Preset:
    """Return the preset of this name.

    Raises a DiffractionError if the name is unknown; the text names the nearest.
    """
    known = presets()
    if name in known:
        return known[name]
    near = difflib.get_close_matches(name.lower(), known, 3, 0.4)
    near += [other for other in known if name.lower() in other and other not in near]
    hint = f"did you mean {' or '.join(near[:3])}?" if name and near else "choose one of "
    hint += "" if name and near else ", ".join(known)
    raise DiffractionError(f"there is no preset {quoted(name)}; {hint}")


def preset(name: str, **changes: Any) -> dict[str, Any]:
    """Return the dictionary of a preset's BSDF for `mi.load_dict`.

    Raises a DiffractionError if the preset is unknown; the text names the nearest.

    Parameters
    ----------
    name : a preset that `mitsuba-diffraction presets` lists, e.g. "cd".
    changes : parameters of the BSDF in place of the record's, e.g. orientation=90; None is the
        same as leaving it out.
    """
    given = {key: value for key, value in changes.items() if value is not None}
    return find_preset(name).changed(given)


def diffraction_preset(props: Properties) -> BSDF:
    """Return the BSDF of the preset that the parameter `preset` names, with further parameters.

    Raises a DiffractionError if the preset is unknown, or a parameter does not fit its BSDF.
    """
    if PARAMETER not in props:
        if near := difflib.get_close_matches(PARAMETER, props.keys(), 1):
            raise DiffractionError(f"unknown parameter {near[0]!r}; did you mean {PARAMETER}?")
        raise DiffractionError(f"{PLUGIN}: the parameter {PARAMETER} is missing; e.g. cd")
    changes = {key: props[key] for key in props.keys() if key != PARAMETER}  # noqa: SIM118
    return mi.load_dict(preset(str(props[PARAMETER]), **changes) | {"id": props.id()})


if mi.variant() is not None:  # else `registration` reloads this module once there is one
    mi.register_bsdf(PLUGIN, diffraction_preset)
