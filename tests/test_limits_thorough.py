"""Small files take neither memory nor time, and end no process."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from tests.support import ROOT
from tests.support.small_scenes import FILES

pytestmark = pytest.mark.thorough

# Importing Mitsuba takes 0.2 GB, and what a file may hold 0.5 GB, twice while it is copied
MOST_BYTES = 1_500_000_000
MOST_SECONDS = 20.0


def test_small_files_take_neither_memory_nor_time(tmp_path):
    """All are read in one process, so that each peak is that of all files before as well."""
    ran = subprocess.run(
        [sys.executable, "-m", "tests.support.small_scenes", tmp_path, *FILES],
        cwd=ROOT, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr[-500:]
    lines = [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]
    assert [line["name"] for line in lines] == list(FILES)
    for line in lines:
        assert line["seconds"] < MOST_SECONDS, line
        assert line["peak"] < MOST_BYTES, line
        assert line["refusal"], line
