"""Every test chooses anew."""

from __future__ import annotations

import sys

import pytest

from mitsuba_diffraction.llvm import VARIABLE


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch) -> None:
    """No choice made yet, and Dr.Jit as if not imported."""
    # set, then deleted, so that what a test chooses is undone as well
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.delenv(VARIABLE)
    monkeypatch.delitem(sys.modules, "drjit", raising=False)
