"""A disk that becomes full leaves a whole file or the file that was there, and an error."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.support import ROOT

pytestmark = pytest.mark.thorough


def test_no_writer_leaves_a_part_of_a_file_on_a_full_disk(tmp_path):
    private = ["unshare", "--mount"] if os.name == "posix" and os.geteuid() == 0 else []
    try:
        subprocess.run([*private, "mount", "--version"], check=True, capture_output=True)
        may = bool(private)
    except (OSError, subprocess.CalledProcessError):
        may = False
    if not may:
        pytest.skip("no file system may be mounted here")
    ran = subprocess.run(
        [*private, sys.executable, "-m", "tests.support.full_disk", str(tmp_path)],
        cwd=ROOT, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    *wrong, tried = ran.stdout.splitlines()
    assert int(tried.removeprefix("tried ")) > 80
    assert wrong == []
