"""Pages of plates, which have little light between surfaces."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def _few_points(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trace little light between surfaces, of which a plate alone has none; few height scales."""
    monkeypatch.setattr("mitsuba_diffraction.realtime.glsl.bounces._POINTS", 1 << 8)
    monkeypatch.setattr("mitsuba_diffraction.realtime.web.export.OCTAVES", (-1.0, 0.0))
