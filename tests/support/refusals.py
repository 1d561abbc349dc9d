"""What is said of files that hold no heights."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mitsuba_diffraction import DiffractionError, HeightField


def refusal(path: Path, **options: Any) -> str:
    """The one line with which a file is refused."""
    with pytest.raises(DiffractionError) as caught:
        HeightField.load(path, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)
