"""The plugin `diffraction`, registered in every variant of Mitsuba that is set."""

from __future__ import annotations

import importlib
import sys

import mitsuba as mi

_PLUGIN = f"{__package__}.bsdf"


def register(old: str | None, new: str | None) -> None:
    """Define the plugin for the variant just set: its base class is another in each."""
    if new is None:
        return
    if _PLUGIN in sys.modules:
        importlib.reload(sys.modules[_PLUGIN])
    else:
        importlib.import_module(_PLUGIN)


mi.detail.add_variant_callback(register)
if mi.variant() is not None:
    register(None, mi.variant())
