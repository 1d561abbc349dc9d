"""Limits on files, and the refusal of small files that ask for more."""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError, limits
from mitsuba_diffraction.files import read_text, readable_file
from mitsuba_diffraction.scene import set_variant
from tests.support import ROOT
from tests.support.refusals import refused
from tests.support.small_files import FILES


def test_security_lists_the_limits():
    """The table names every limit and its value, and nothing else."""
    rows = re.findall(r"^\| `([A-Z_]+)` \| ([\d,]+) \|", (ROOT / "SECURITY.md").read_text(), re.M)
    listed = {name: int(value.replace(",", "")) for name, value in rows}
    named = {name: value for name, value in vars(limits).items() if isinstance(value, int)}
    assert listed == named


@pytest.mark.parametrize("name", FILES)
def test_a_small_file_is_refused_in_a_line(name, tmp_path):
    set_variant("scalar_rgb")
    path = FILES[name].write(tmp_path)
    refused(lambda: FILES[name].read(path), "")


def test_files_of_the_kernel_are_refused():
    """/proc states a size of 0 for files that have content, some of them without end."""
    if not Path("/proc/self/maps").exists():
        pytest.skip("no /proc here")
    for read in (readable_file, read_text):
        with pytest.raises(DiffractionError, match="without a size"):
            read("/proc/self/maps")


def test_a_file_beyond_the_limit_is_not_read(tmp_path):
    with (tmp_path / "sparse.toml").open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(DiffractionError, match="too large"):
        read_text(tmp_path / "sparse.toml")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux alone bounds memory")
def test_memory_of_other_readers_is_bounded():
    before = resource.getrlimit(resource.RLIMIT_AS)
    with (
        pytest.raises(DiffractionError, match="memory"),
        limits.bounded_memory(1000, "'a.x3p'"),
    ):
        np.empty(1 << 31, np.uint8)
    assert resource.getrlimit(resource.RLIMIT_AS) == before


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="Linux alone bounds memory")
def test_readers_in_several_threads_leave_no_bound():
    before, inside = resource.getrlimit(resource.RLIMIT_AS), threading.Barrier(2, timeout=10)

    def read() -> None:
        inside.wait()
        with limits.bounded_memory(1000, "'a.x3p'"):
            pass

    threads = [threading.Thread(target=read) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert resource.getrlimit(resource.RLIMIT_AS) == before


def test_a_long_header_line_takes_no_quadratic_time(tmp_path):
    """Some 10 ms; with n² steps, minutes."""
    digits = "1" * 100_000
    lines = (
        f"# Width: {digits} x y\n#{' ' * 100_000}x\n# Value units: {'x' * 100_000} y\n1 2\n3 4\n"
    )
    (tmp_path / "heights.txt").write_text(lines)
    assert FILES["long_line.csv"].read(tmp_path / "heights.txt").shape == (2, 2)


def test_a_large_measurement_is_no_bomb(tmp_path):
    """Heights that are not compressed may have any size within the limit of pixels."""
    limits.check_content(8 * limits.MOST_PIXELS, limits.MOST_PIXELS, "'scan.png'")
    with pytest.raises(DiffractionError, match="claim"):
        limits.check_content(8 * limits.MOST_PIXELS, os.path.getsize(__file__), "'scan.png'")


# Importing Mitsuba takes 0.2 GB, and what a file may hold 0.5 GB, twice while it is copied
MOST_BYTES = 1_500_000_000
MOST_SECONDS = 20.0


@pytest.mark.thorough
def test_small_files_take_neither_memory_nor_time(tmp_path):
    """All are read in one process, so that each peak is that of all files before as well."""
    ran = subprocess.run(
        [sys.executable, "-m", "tests.support.small_files", tmp_path, *FILES],
        cwd=ROOT, capture_output=True, text=True, timeout=600, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr[-500:]
    lines = [json.loads(line) for line in ran.stdout.splitlines() if line.startswith("{")]
    assert [line["name"] for line in lines] == list(FILES)
    for line in lines:
        assert line["seconds"] < MOST_SECONDS, line
        assert line["peak"] < MOST_BYTES, line
        assert line["refusal"], line
