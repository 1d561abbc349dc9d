"""Description of the machine that measures: processor, load, memory, versions."""

from __future__ import annotations

import importlib.metadata
import platform
from typing import Any

import drjit as dr
import psutil

from ..llvm import loaded_llvm_version
from ..system import cores, processor

_PACKAGES = ("mitsuba_diffraction", "mitsuba", "drjit", "numpy", "scipy")


def describe_machine() -> dict[str, Any]:
    """Return processor, cores, load of the last minute, memory, and versions of packages."""
    llvm = loaded_llvm_version()
    return {
        "processor": processor(),
        "cores": cores(),
        "threads of Dr.Jit": dr.thread_count(),
        "load": round(psutil.getloadavg()[0], 2),
        "memory": f"{psutil.virtual_memory().total / 1e9:.1f} GB",
        "system": platform.platform(),
        "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in _PACKAGES},
        "llvm": ".".join(map(str, llvm)) if llvm else None,
    }
