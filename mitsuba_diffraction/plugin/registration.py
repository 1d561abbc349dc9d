"""Registration of the plugins in every variant of Mitsuba that is set.

Mitsuba 3.10 imports this module by itself, which imports the package, and reloads it at each change
of variant. So nothing happens here but definitions: the package calls `register_in_all` once.
"""

from __future__ import annotations

import importlib
import sys

import mitsuba as mi

from . import arithmetic, installed

# Base classes first
_MODULES = (
    "base", "surface", "diffraction", "diffraction_dielectric",
    "orders.diffraction_orders", "orders.orders_sheet", "orders.orders_block", "diffraction_mix",
    "presets",
)  # fmt: skip


def register(old: str | None, new: str | None) -> None:
    """Define the plugins for the variant just set: their base class is another in each."""
    if new is None:
        return
    for module in (f"{__package__}.{name}" for name in _MODULES):
        if module in sys.modules:
            importlib.reload(sys.modules[module])
        else:
            importlib.import_module(module)


def register_in_all() -> None:
    """Register the plugins in the current variant, and in every one that is set later.

    Mitsuba then looks for files in its own folder first (`installed`).
    """
    installed.search_first()
    installed.reserve_names()
    arithmetic.register()
    mi.detail.add_variant_callback(register)
    if mi.variant() is not None:
        register(None, mi.variant())
