"""Build one table in a process of its own, and print what it cost as JSON.

`python -m ...build_child HEIGHTS.npy PIXEL_SIZE ARGUMENTS`, the last being those of
`DiffractionTable.build` as JSON; or `... HEIGHTS.npy PIXEL_SIZE make SIDE`, which makes the
heights.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

from ...heights import HeightField, gratings
from ...tables import DiffractionTable
from .machine import peak_memory


def build(heights: str, pixel_size: float, arguments: str) -> None:
    """Build the table of the heights in a file, and print time, memory and the table's summary."""
    imported = peak_memory()
    field = HeightField(np.load(heights), pixel_size, name="elaphe_like")
    start, start_cpu = time.perf_counter(), time.process_time()
    table = DiffractionTable.build(field, **json.loads(arguments))
    report = {
        "seconds": time.perf_counter() - start,
        "cpu_seconds": time.process_time() - start_cpu,
        "peak_bytes": peak_memory(),
        "imported_bytes": imported,
        "table": {k: v for k, v in table.summary().items() if k != "source"},
    }
    print(json.dumps(report))


def make(heights: str, pixel_size: float, side: int) -> None:
    """Write the heights of a patch with so many pixels a side."""
    np.save(heights, gratings.elaphe_like(side * pixel_size, side).heights)


if __name__ == "__main__":
    if sys.argv[3] == "make":
        make(sys.argv[1], float(sys.argv[2]), int(sys.argv[4]))
    else:
        build(sys.argv[1], float(sys.argv[2]), sys.argv[3])
