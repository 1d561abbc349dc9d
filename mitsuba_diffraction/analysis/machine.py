"""Description of the machine that measures: processor, load, memory, versions."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import sys
from typing import Any

from ..cluster.tasks import processor
from ..plugin.llvm import loaded_llvm_version

_PACKAGES = ("mitsuba_diffraction", "mitsuba", "drjit", "numpy", "scipy")


def describe_machine() -> dict[str, Any]:
    """Return processor, cores, load of the last minute, memory, and versions of packages."""
    import drjit as dr

    llvm = loaded_llvm_version()
    return {
        "processor": processor(),
        "cores": len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count(),
        "threads of Dr.Jit": dr.thread_count(),
        "load": round(os.getloadavg()[0], 2),
        "memory": f"{os.sysconf('SC_PAGE_SIZE') * os.sysconf('SC_PHYS_PAGES') / 1e9:.1f} GB",
        "system": platform.platform(),
        "python": platform.python_version(),
        **{name: importlib.metadata.version(name) for name in _PACKAGES},
        "llvm": ".".join(map(str, llvm)) if llvm else None,
    }
