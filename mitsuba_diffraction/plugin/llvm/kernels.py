"""A few kernels that an unsuitable LLVM cannot compile. It ends the process: run it in a child.

Prints the version that Dr.Jit loaded, then "usable" once the kernels ran with the right result.
"""

from __future__ import annotations

from typing import Any

import drjit as dr
from drjit.detail import llvm_version


def run_kernels() -> bool:
    """Whether minimum, maximum, a packet gather and a loop give what they should."""
    from drjit.llvm import ArrayXf, Float, Float64, UInt32

    lanes = 37
    right = True
    for real in (Float, Float64):
        # evaluated first, so that the minimum is of two memory loads and not folded away
        x: Any = real(dr.arange(UInt32, lanes))
        dr.eval(x)
        between = dr.minimum(dr.maximum(x, 5), 20)
        right &= bool(dr.all(between == dr.select(x < 5, 5, dr.select(x > 20, 20, x))))

    table = dr.arange(Float, 8 * lanes)
    dr.eval(table)
    packets = dr.gather(ArrayXf, table, dr.arange(UInt32, lanes), shape=(8, lanes))
    right &= bool(dr.all(dr.sum(packets, axis=0) == 64 * dr.arange(Float, lanes) + 28))

    def body(count: UInt32, total: Float) -> tuple[UInt32, Float]:
        return count + 1, total + dr.sqrt(dr.minimum(total, 4))

    _, total = dr.while_loop(
        (dr.arange(UInt32, lanes), dr.full(Float, 4, lanes)), lambda count, total: count < 40, body
    )
    return right & bool(dr.all(total == 4 + 2 * (40 - dr.arange(Float, lanes))))


def main() -> None:
    """Print the version; print "usable" if the kernels survive."""
    major, minor, patch = llvm_version()
    print(major, minor, patch, flush=True)
    if major > 0 and run_kernels():
        print("usable", flush=True)


if __name__ == "__main__":
    main()
