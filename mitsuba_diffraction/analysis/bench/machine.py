"""What the figures depend on besides the code."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import resource
import sys
from pathlib import Path
from typing import Any

_PACKAGES = ("mitsuba_diffraction", "mitsuba", "drjit", "numpy", "scipy")


def describe_machine() -> dict[str, Any]:
    """Processor, cores, load of the last minute, memory, and versions of all that computes."""
    import drjit as dr

    from ...plugin.llvm import loaded_llvm_version

    llvm = loaded_llvm_version()
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0)) if sys.platform == "linux" else os.cpu_count(),
        "threads of Dr.Jit": dr.thread_count(),
        "load": round(os.getloadavg()[0], 2),
        "memory": f"{_memory() / 1e9:.1f} GB",
        "system": platform.platform(),
        "python": platform.python_version(),
        **{name: _version(name) for name in _PACKAGES},
        "llvm": ".".join(map(str, llvm)) if llvm else None,
    }


def peak_memory() -> int:
    """Most bytes that this process has had in memory at once."""
    status = Path("/proc/self/status")
    if status.is_file():
        # ru_maxrss of a child starts at what its parent had when it was started; this does not
        for line in status.read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.is_file():
        for line in cpuinfo.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.split(":", 1)[1].strip()
    return platform.processor() or platform.machine()


def _memory() -> int:
    return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return "unknown"
