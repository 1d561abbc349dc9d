"""The libraries of this machine, or of one that a test makes up."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from mitsuba_diffraction import llvm
from mitsuba_diffraction.llvm import version_of

HERE = [path.resolve() for path in llvm.in_folders()]


def installed(version: int) -> Path:
    """The library of that version on this machine, or skip."""
    for library in HERE:
        if version_of(library) == version:
            return library
    pytest.skip(f"LLVM {version} is not installed here")


def only(monkeypatch: pytest.MonkeyPatch, *files: Path) -> None:
    """Make these the only libraries of the machine."""
    monkeypatch.setattr(llvm, "in_folders", lambda: iter(files))


def python(code: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run code in a process of its own, with these environment variables on top."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**environment, **variables},
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
