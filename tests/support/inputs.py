"""Small inputs of every kind that commands read, and what they name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

from mitsuba_diffraction import DiffractionTable
from tests.support.directions import rough_patch
from tests.support.meshes import ply_text
from tests.support.orders import thin_grating

SCENE = """<scene version="3.0.0"><default name="width" value="4"/>
<include filename="light.xml"/><integrator type="path"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="$width"/>
<integer name="height" value="4"/></film><sampler type="independent">
<integer name="sample_count" value="1"/></sampler></sensor>
<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">
<string name="filename" value="scale.png"/></texture></bsdf></shape>
<shape type="ply"><string name="filename" value="mesh.ply"/></shape>
<shape type="sphere" id="ball"><bsdf type="diffraction" id="skin">
<string name="filename" value="recipe.toml"/><string name="material" value="Al"/></bsdf></shape>
</scene>"""
LIGHT = """<scene version="3.0.0"><emitter type="envmap">
<string name="filename" value="sky.exr"/></emitter></scene>"""
_TETRAHEDRON = (0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)
PLY = ply_text([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], _TETRAHEDRON, "xyz")
#: Options of a small table.
SMALL = "--coherence-width 2 --tolerance 0.05"
HEIGHTS = f"--pixel-size 0.1 {SMALL}"
RENDER = "render scale.xml -m scalar_rgb -s 1"
#: What files name.
NAMED = {
    "scale.xml": ("light.xml", "sky.exr", "scale.png", "mesh.ply", "recipe.toml", "h.npy"),
    "recipe.toml": ("h.npy",),
}


def write_inputs(folder: Path) -> None:
    """Write them into a folder; the scene is `scale.xml`."""
    field = rough_patch((20, 24), (0.1, 0.1), 0.05)
    np.save(folder / "h.npy", field.heights)
    grey = np.uint8(255 * (field.heights - field.heights.min()) / np.ptp(field.heights))
    Image.fromarray(grey).save(folder / "scale.png")
    Image.fromarray(np.stack([grey > 127] * 3, -1).astype(np.uint8) * 255).save(folder / "logo.png")
    DiffractionTable.build(field, coherence_width=2.0, tolerance=0.05).save(folder / "t.exr")
    thin_grating(0.6, counts=(2, 2, 1)).save(folder / "orders.nc")
    texts = {
        "scale.xml": SCENE, "light.xml": LIGHT, "mesh.ply": PLY,
        "recipe.toml": 'source = "h.npy"\npixel_size = 0.1\ncoherence_width = 2\n'
        "tolerance = 0.05\n",
        "pigment.csv": "400,0.2\n700,0.4\n", "profile.txt": "0 0\n0.3 0.05\n0.6 0\n",
        "layers.toml": 'layers = [["SiO2", 0.1]]\n',
        "treatments.toml": '["*.npy"]\npixel_size = 0.1\n',
    }  # fmt: skip
    for name, text in texts.items():
        (folder / name).write_text(text)
    OpenEXR.File({}, {"RGB": np.ones((2, 4, 3), np.float32)}).write(str(folder / "sky.exr"))
