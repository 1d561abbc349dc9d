"""Pages of plates, which have little light between surfaces."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trace little light between surfaces, of which a plate alone has none."""
    monkeypatch.setattr("mitsuba_diffraction.realtime.glsl.bounces._POINTS", 1 << 8)
