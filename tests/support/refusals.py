"""What is said of requests that are refused."""

from __future__ import annotations

import re
from collections.abc import Callable
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


def refused(ask: Callable[[], object], words: str) -> None:
    """Check that a request is refused in one line of ours that has these words, a pattern.

    Lines of Mitsuba go before the line of a plugin that cannot be loaded.
    """
    with pytest.raises((DiffractionError, RuntimeError)) as caught:
        ask()
    *before, line = str(caught.value).splitlines()
    assert not before or line.startswith("DiffractionError: "), caught.value
    assert isinstance(caught.value, DiffractionError) or before, caught.value
    assert re.search(words, line), line


def file(name: str, content: str | bytes) -> Path:
    """Write a file of this content into the current folder; return its path."""
    Path(name).write_bytes(content.encode() if isinstance(content, str) else content)
    return Path(name)
