"""docs/validation/transmission.md: orders that go through a dielectric."""

from __future__ import annotations

from .. import passed
from .measurements import Measurements


def write(measured: Measurements) -> str:
    """Write the page."""
    gratings = passed.GRATINGS[:1] if measured.quick else passed.GRATINGS
    return passed.section(gratings).replace("## ", "# ", 1)
