"""Files as instruments write them, for tests of what reads them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray


def nanoscope(
    counts: NDArray[np.int16],
    channels: Sequence[tuple[str, str]] = (("ZSensor", "nm"),),
    scan_size: str = "3 2 ~m",
) -> bytes:
    """A NanoScope file: 0.5 V full scale, 100 units of height per volt; `counts` is any channel."""
    counts = np.asarray(counts, "<i2")
    rows, columns = counts.shape
    header = ["\\*File list", "\\Version: 0x05120000", "\\*Ciao scan list"]
    header += [f"\\@Sens. {name}: V 100.0 {unit}/V" for name, unit in channels]
    sections = []
    for i, (name, _) in enumerate(channels):
        sections += [
            "\\*Ciao image list", f"\\Data offset: {4096 + i * counts.nbytes}",
            f"\\Data length: {counts.nbytes}", "\\Bytes/pixel: 2", f"\\Samps/line: {columns}",
            f"\\Number of lines: {rows}", f"\\Scan size: {scan_size}",
            f'\\@2:Image Data: S [{name}] "{name}"',
            f"\\@2:Z scale: V [Sens. {name}] (0.0000076 V/LSB) 0.5 V",
        ]  # fmt: skip
    text = "\r\n".join([*header, *sections, "\\*File list end"]) + "\r\n"
    return text.encode("latin-1").ljust(4096, b"\0") + counts.tobytes() * len(channels)
