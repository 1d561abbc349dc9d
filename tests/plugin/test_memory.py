"""What kernels read is what was stored, and nothing beside it."""

from __future__ import annotations

import subprocess
import sys

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.plugin.memory import HalfFloats

#: Uploads arrays that end where a page of memory ends that must not be read.
AT_THE_EDGE = """
import ctypes, mmap, numpy as np, mitsuba as mi
mi.set_variant("llvm_ad_spectral")
from mitsuba_diffraction.plugin.memory import tensor, upload
page, libc = mmap.PAGESIZE, ctypes.CDLL(None)
pages = mmap.mmap(-1, 2 * page)
start = ctypes.addressof(ctypes.c_char.from_buffer(pages))
assert libc.mprotect(ctypes.c_void_p(start + page), ctypes.c_size_t(page), 0) == 0
for kind, stored in ((mi.Float, np.float32), (mi.UInt32, np.uint32)):
    values = np.frombuffer(pages, stored, 17, page - 17 * 4)
    assert not np.array(upload(kind, values)).any()
assert not np.array(tensor(values.view(np.float32)) + 0.0).any()
"""
#: Least normal half float; smaller ones are read as 0.
NORMAL = 2.0**-14


@pytest.mark.parametrize("numbers", [1, 2, 3, 4, 6, 8, 10, 16, 24, 32, 40])
def test_halves_are_read_as_stored(some_variant: str, numbers: int) -> None:
    generator = np.random.default_rng(numbers)
    sizes = 2.0 ** generator.uniform(-20.0, 15.9, (50, numbers))
    stored = (sizes * generator.choice([-1.0, 0.0, 1.0], sizes.shape)).astype(np.float16)
    places = generator.permutation(50)
    halves = HalfFloats(stored)
    packets = halves.read(mi.UInt32(places))
    dr.eval(packets)  # one kernel
    read = np.stack([np.array(x) for packet in packets for x in packet], axis=1) * halves.scale
    expected = np.where(np.abs(stored) < NORMAL, np.float16(0), stored)[places]
    np.testing.assert_array_equal(read[:, :numbers], expected)
    assert not read[:, numbers:].any()


def test_inactive_lanes_read_zeros(some_variant: str) -> None:
    halves = HalfFloats(np.ones((3, 8), np.float16))
    far, active = mi.UInt32([1, 1 << 30]), mi.Bool([True, False])
    sums = sum(dr.sum(packet, axis=0) for packet in halves.read(far, active))
    np.testing.assert_array_equal(np.array(sums) * halves.scale, [8.0, 0.0])


@pytest.mark.skipif(sys.platform == "win32", reason="memory is protected by a function of Unix")
def test_no_memory_beyond_an_array_is_read() -> None:
    subprocess.run([sys.executable, "-c", AT_THE_EDGE], check=True)
