"""Registration of the plugins in every variant of Mitsuba that is set.

Mitsuba 3.10 imports this module by itself, which imports the package, and reloads it at each change
of variant. So nothing happens here but definitions: the package calls `register_in_all` once.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Sequence

import mitsuba as mi

from . import arithmetic, installed

# Base classes first
_MODULES = (
    "base", "surface", "diffraction", "diffraction_dielectric", "diffraction_mix", "presets",
)  # fmt: skip


def register(modules: Sequence[str], variant: str | None) -> None:
    """Define the plugins for the variant just set: their base class is another in each."""
    if variant is None:
        return
    for module in modules:
        if module in sys.modules:
            importlib.reload(sys.modules[module])
        else:
            importlib.import_module(module)


def register_in_all(*more: str) -> None:
    """Register the plugins in the current variant, and in every one that is set later.

    Mitsuba then looks for files in its own folder first (`installed`).

    more : modules of rooms above, which define plugins.
    """
    installed.search_first()
    installed.reserve_names()
    arithmetic.register()
    modules = (*(f"{__package__}.{name}" for name in _MODULES), *more)
    mi.detail.add_variant_callback(lambda old, new: register(modules, new))
    register(modules, mi.variant())
