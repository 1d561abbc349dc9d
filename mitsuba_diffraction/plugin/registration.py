"""Registration of the plugins in every variant of Mitsuba that is set."""

from __future__ import annotations

import importlib
import sys

import mitsuba as mi

# Base classes first: the plugins inherit from `surface`
_MODULES = ("surface", "bsdf", "transmission.bsdf", "orders.bsdf", "blended_patches")


def register(old: str | None, new: str | None) -> None:
    """Define the plugins for the variant just set: their base class is another in each."""
    if new is None:
        return
    for module in (f"{__package__}.{name}" for name in _MODULES):
        if module in sys.modules:
            importlib.reload(sys.modules[module])
        else:
            importlib.import_module(module)


mi.detail.add_variant_callback(register)
if mi.variant() is not None:
    register(None, mi.variant())
