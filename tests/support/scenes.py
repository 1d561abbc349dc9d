"""The scenes of the project, rendered small."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.support import ROOT

SCENES = ROOT / "scenes"
SMALL = {"spp": "4", "resx": "48", "resy": "40"}


def rendered(name: str, **parameters: str) -> np.ndarray:
    """The picture of a scene, of 48 × 40 pixels unless told otherwise."""
    import mitsuba as mi

    from mitsuba_diffraction.scene import load_scene

    scene = load_scene(SCENES / f"{name}.xml", SMALL | parameters)
    return np.array(mi.render(scene, seed=1))


@contextlib.contextmanager
def searched(folder: Path) -> Iterator[None]:
    """Let Mitsuba look for files in this folder first."""
    import mitsuba as mi

    before = mi.file_resolver()
    resolver = mi.FileResolver(before)
    resolver.prepend(str(folder))
    mi.set_file_resolver(resolver)
    try:
        yield
    finally:
        mi.set_file_resolver(before)


def gentle_patch(folder: Path) -> dict[str, str]:
    """Parameters of any scene: a grating whose table and bound take a second."""
    from mitsuba_diffraction.heights import gratings

    field = gratings.sinusoidal(period=1.6, depth=0.05, periods=4, rows=4)
    file = folder / "gentle.npy"
    np.save(file, field.heights)
    return {"patch": str(file), "pixel_size": str(field.pixel_size[0]), "coherence_width": "10"}
