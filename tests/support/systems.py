"""Tests of what only some operating systems have."""

from __future__ import annotations

import sys

import pytest

#: For tests with pipes among files, forks, bash, or limits of a process.
posix = pytest.mark.skipif(sys.platform == "win32", reason="Windows has nothing of the kind")
linux = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="it has no /proc")
