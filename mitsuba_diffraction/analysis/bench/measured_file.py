"""A file for Mitsuba's plugin `measured`, as large as those of real surfaces, to time it with."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

# what an anisotropic surface takes, in the sampling of Dupuy and Jakob 2018
AZIMUTHS, ANGLES, WAVELENGTHS, SIDE = 8, 8, 195, 32
_TYPES = {"uint8": 1, "float32": 10}  # of the file


def write_measured(path: Path) -> None:
    """A surface that reflects alike everywhere: values do not matter for the time that it takes."""

    def ones(*shape: int) -> NDArray[np.float32]:
        return np.ones(shape, np.float32)

    fields: dict[str, NDArray[Any]] = {
        "description": np.frombuffer(b"even", np.uint8),
        "theta_i": np.linspace(0.0, 1.5, ANGLES, dtype=np.float32),
        "phi_i": np.linspace(-np.pi, np.pi, AZIMUTHS, dtype=np.float32),
        "ndf": ones(128, 128),
        "sigma": ones(128, 128),
        "vndf": ones(AZIMUTHS, ANGLES, 128, 128),
        "luminance": ones(AZIMUTHS, ANGLES, SIDE, SIDE),
        "spectra": ones(AZIMUTHS, ANGLES, WAVELENGTHS, SIDE, SIDE),
        "wavelengths": np.linspace(360.0, 1000.0, WAVELENGTHS, dtype=np.float32),
        "jacobian": np.zeros(1, np.uint8),
    }
    size = 18 + sum(len(n) + 13 + 8 * field.ndim for n, field in fields.items())
    header = [b"tensor_file\0", struct.pack("<BBI", 1, 0, len(fields))]
    offset = -(-size // 8) * 8
    contents = []
    for name, field in fields.items():
        header.append(struct.pack("<H", len(name)) + name.encode())
        header.append(struct.pack("<HBQ", field.ndim, _TYPES[field.dtype.name], offset))
        header.append(struct.pack(f"<{field.ndim}Q", *field.shape))
        data = field.tobytes()
        contents.append(data.ljust(-(-len(data) // 8) * 8, b"\0"))
        offset += len(contents[-1])
    path.write_bytes(b"".join(header).ljust(-(-size // 8) * 8, b"\0") + b"".join(contents))
