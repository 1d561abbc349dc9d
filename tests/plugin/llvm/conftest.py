"""Every test chooses anew."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mitsuba_diffraction.plugin.llvm import choose, trial
from mitsuba_diffraction.plugin.llvm.find import VARIABLE


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """No choice made yet, nothing remembered, and Dr.Jit as if not imported."""
    monkeypatch.setenv("MITSUBA_DIFFRACTION_CACHE", str(tmp_path / "cache"))
    # set, then deleted, so that what a test chooses is undone as well
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.delenv(VARIABLE)
    monkeypatch.delitem(sys.modules, "drjit", raising=False)
    trial.tried.cache_clear()
    choose._require_loaded.cache_clear()
    yield
    trial.tried.cache_clear()
    choose._require_loaded.cache_clear()


@pytest.fixture
def no_child(monkeypatch: pytest.MonkeyPatch) -> None:
    """Starting a child process fails the test."""

    def run(*args: object, **_: object) -> None:
        raise AssertionError(f"started {args}")

    monkeypatch.setattr(subprocess, "run", run)
