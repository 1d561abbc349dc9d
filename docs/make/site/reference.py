"""Page of the public names of the package, for mkdocstrings."""

from __future__ import annotations

import importlib
from types import ModuleType

import mitsuba_diffraction as md


def page() -> str:
    """Return the page: a section for each public name, modules with the names in `__all__`."""
    parts = [
        "# API reference",
        "Public names of `import mitsuba_diffraction as md`. The parameters of the plugins are on\n"
        "[parameters.md](parameters.md).",
    ]
    for name in md.__all__:
        value = getattr(md, name)
        if isinstance(value, ModuleType):
            parts.append(_module(name, value))
        else:
            parts.append(f"## md.{name}\n\n{_directive(value.__module__, value.__qualname__)}")
    return "\n\n".join(parts) + "\n"


def _module(name: str, module: ModuleType) -> str:
    summary = (module.__doc__ or "").split("\n\n")[0]
    parts = [f"## md.{name}", summary]
    for member in getattr(module, "__all__", []):
        value = getattr(module, member, module)  # modules may not be imported yet
        if isinstance(value, ModuleType):
            continue
        where = getattr(value, "__module__", None)
        if where is not None and where.startswith(md.__name__) and hasattr(value, "__qualname__"):
            importlib.import_module(where)
            parts.append(f"### md.{name}.{member}\n\n{_directive(where, value.__qualname__)}")
    return "\n\n".join(parts)


def _directive(module: str, name: str) -> str:
    options = "show_root_heading: false", "show_root_toc_entry: false"
    return "\n      ".join([f"::: {module}.{name}\n    options:", *options])
