"""Files from several threads at once, and what is no file."""

from __future__ import annotations

import contextlib
import os
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import OpenEXR
from PIL import Image

from mitsuba_diffraction import DiffractionError, HeightField


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
