"""Every LLVM of this machine that may be chosen compiles the kernels that older ones die of."""

from __future__ import annotations

from pathlib import Path

import pytest

from mitsuba_diffraction.llvm import OLDEST, VARIABLE
from tests.support.machine import HERE, python

KERNELS = """
import drjit as dr
from drjit.llvm import ArrayXf, Float, Float64, UInt32

for real in (Float, Float64):
    # evaluated first, so that the minimum is of two memory loads and not folded away
    x = real(dr.arange(UInt32, 37))
    dr.eval(x)
    between = dr.minimum(dr.maximum(x, 5), 20)
    assert dr.all(between == dr.select(x < 5, 5, dr.select(x > 20, 20, x)))

table = dr.arange(Float, 8 * 37)
dr.eval(table)
packets = dr.gather(ArrayXf, table, dr.arange(UInt32, 37), shape=(8, 37))
assert dr.all(dr.sum(packets, axis=0) == 64 * dr.arange(Float, 37) + 28)

_, total = dr.while_loop(
    (dr.arange(UInt32, 37), dr.full(Float, 4, 37)),
    lambda count, total: count < 40,
    lambda count, total: (count + 1, total + dr.sqrt(dr.minimum(total, 4))),
)
assert dr.all(total == 4 + 2 * (40 - dr.arange(Float, 37)))
print("usable")
"""


@pytest.mark.parametrize("path", sorted({lib.path for lib in HERE if (lib.version or 0) >= OLDEST}))
def test_what_may_be_chosen_compiles_the_kernels(path: Path, tmp_path: Path):
    # a kernel that was compiled earlier would prove nothing
    done = python(KERNELS, **{VARIABLE: str(path), "DRJIT_CACHE_DIR": str(tmp_path)})
    assert done.stdout == "usable\n", done.stderr
