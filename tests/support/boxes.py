"""A glTF file of two materials, written by trimesh."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

RED = [0.8, 0.1, 0.1]


def write_boxes(file: Path, body: str = "Body", cap: str = "Cap") -> None:
    """A box of the material `body` below a smaller red metal one, `cap`."""
    trimesh = pytest.importorskip("trimesh")
    scene = trimesh.Scene()
    for name, side, height, colour in ((body, 2.0, 1.0, [1.0] * 4), (cap, 1.0, 2.5, [*RED, 1])):
        box = trimesh.creation.box([side, side, side])
        box.apply_translation([0.0, height, 0.0])
        material = trimesh.visual.material.PBRMaterial(
            name=name, baseColorFactor=colour, metallicFactor=0.75, roughnessFactor=0.25
        )
        uv = np.tile([0.25, 0.75], (len(box.vertices), 1))
        box.visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        scene.add_geometry(box, node_name=f"node of {name}")
    scene.export(file)
