"""Operating system: processor, memory and processes, asked alike on Linux, macOS and Windows."""

from __future__ import annotations

import contextlib
import os
import platform
import sys
from collections.abc import Iterator, Mapping
from functools import lru_cache
from pathlib import Path

import psutil


def cores() -> int:
    """Return the number of logical cores that this process may use."""
    if sys.platform == "darwin":  # macOS binds no process to cores
        return os.cpu_count() or 1
    return len(psutil.Process().cpu_affinity())


def peak_memory() -> int:
    """Return the largest memory that this process has held at once, bytes."""
    if sys.platform == "win32":
        return int(psutil.Process().memory_info().peak_wset)
    status = Path("/proc/self/status")
    if status.is_file():
        # getrusage of a child process starts at the peak of its parent; this figure does not
        for line in status.read_text(encoding="ascii", errors="replace").splitlines():
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    import resource

    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak if sys.platform == "darwin" else 1024 * peak


def memory() -> int:
    """Return the memory of this machine, bytes."""
    return int(psutil.virtual_memory().total)


def process_lives(number: int) -> bool:
    """Return whether a process of this number exists, of any user."""
    try:
        return bool(psutil.pid_exists(number))
    except OverflowError:  # larger than the number of any process
        return False


@contextlib.contextmanager
def environment(values: Mapping[str, str]) -> Iterator[None]:
    """Set variables of the environment inside, which processes that start inside inherit."""
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


@lru_cache(1)
def processor() -> str:
    """Return the kind of this machine's processor."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            names = [
                line.partition(":")[2].strip() for line in file if line.startswith("model name")
            ]
    except OSError:
        names = []
    return names[0] if names else platform.processor() or platform.machine()
