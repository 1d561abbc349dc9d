"""Files from several threads at once, and what is no file."""

from __future__ import annotations

import contextlib
import os
import signal
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from mitsuba_diffraction import DiffractionError, HeightField
from tests.support.systems import posix


def test_loading_in_threads_leaves_the_streams_of_the_process_alone(tmp_path):
    pixels = np.random.default_rng(0).random((64, 64)).astype(np.float32)
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"Y": pixels}).write(str(tmp_path / "a.exr"))
    Image.fromarray(np.uint8(255 * pixels)).save(tmp_path / "a.png")
    whole = (tmp_path / "a.exr").read_bytes()
    (tmp_path / "cut.exr").write_bytes(whole[: len(whole) // 2])
    streams, number = (sys.stdout, sys.stderr), os.fstat(2).st_ino
    seen = []

    def load(n):
        with contextlib.suppress(DiffractionError):
            name = ("a.exr", "cut.exr", "a.png")[n % 3]
            HeightField.load(tmp_path / name, pixel_size=0.1, max_height=1 if n % 3 == 2 else None)
        seen.append((sys.stdout, sys.stderr) == streams and os.fstat(2).st_ino == number)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(load, range(200)))
    assert all(seen)
    assert (sys.stdout, sys.stderr) == streams
    assert os.fstat(2).st_ino == number


@posix
@pytest.mark.parametrize("name", ["pipe.npy", "pipe.toml", "pipe"])
def test_a_pipe_is_refused_at_once(tmp_path, name):
    os.mkfifo(tmp_path / name)
    before = signal.signal(signal.SIGALRM, _waits)
    signal.alarm(20)
    try:
        with pytest.raises(DiffractionError, match="is a pipe or a device"):
            HeightField.load(tmp_path / name)
    finally:
        signal.alarm(0)
        signal.signal(signal.SIGALRM, before)


def _waits(*_: object) -> None:
    pytest.fail("it waits for somebody to write into the pipe")
