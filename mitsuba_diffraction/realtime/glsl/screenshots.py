"""What a window shows, as PNG files that are numbered."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from ...atomic import atomic_path


def write_screenshot(shown: NDArray[np.floating], folder: Path, stem: str) -> Path:
    """Write a picture as `stem_000.png`, or the next number that is free.

    Parameters
    ----------
    shown : (height, width, 3) sRGB, 0 to 1; what is beyond is cut.

    Raises
    ------
    DiffractionError
        If it cannot be written.
    """
    number = 0
    while (path := folder / f"{stem}_{number:03d}.png").exists():
        number += 1
    eight_bits = (np.clip(shown, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)
    with atomic_path(path) as temporary:
        Image.fromarray(eight_bits).save(temporary)
    return path
