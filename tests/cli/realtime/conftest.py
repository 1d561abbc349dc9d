"""Pages of plates, which have little light between surfaces."""

from __future__ import annotations

import pytest

from tests.support.coarse import little_light


@pytest.fixture(autouse=True)
def _little_light(monkeypatch: pytest.MonkeyPatch) -> None:
    """Trace little light between surfaces, of which a plate alone has none; one height scale."""
    little_light(monkeypatch.setattr)
