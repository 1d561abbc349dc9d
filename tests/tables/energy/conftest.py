"""Energy conserved as finely as users have it."""

from __future__ import annotations

import pytest


@pytest.fixture(scope="module", autouse=True)
def as_users_have_it(fine: None) -> None:
    """All modules of this folder ask how well energy is conserved."""
