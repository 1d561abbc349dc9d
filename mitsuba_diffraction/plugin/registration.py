"""The plugins `diffraction` and `diffraction_mix`, in every variant of Mitsuba that is set."""

from __future__ import annotations

import importlib
import sys

import mitsuba as mi

_PLUGINS = (f"{__package__}.bsdf", f"{__package__}.blended_patches")


def register(old: str | None, new: str | None) -> None:
    """Define the plugins for the variant just set: their base class is another in each."""
    if new is None:
        return
    for plugin in _PLUGINS:
        if plugin in sys.modules:
            importlib.reload(sys.modules[plugin])
        else:
            importlib.import_module(plugin)


mi.detail.add_variant_callback(register)
if mi.variant() is not None:
    register(None, mi.variant())
