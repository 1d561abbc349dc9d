"""Small inputs of every kind that commands read, and what they name."""

from __future__ import annotations

import shlex
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
#: A command with each kind of input, and its outputs: suffixes, that of `-o` first, or a
#: file in a folder of its own.
COMMANDS = [
    (RENDER, ".exr .png"), (f"{RENDER} --assign ball=t.exr", ".exr"),
    (f"{RENDER} --assign ball=orders.nc", ".exr"),
    ("render mesh.ply --patch t.exr -m scalar_rgb -s 1 -D resx=4 -D resy=3", ".exr .png"),
    (f"{RENDER} --plan recipe.toml", ".exr"),
    (f"{RENDER} --frames 1 --turn width", "frame_0000.png"),
    ("plan scale.xml --paths 64", ".toml"),
    ("brdf-map recipe.toml --resolution 8 --samples 1 --step 50", ".exr .png"),
    ("brdf-map t.exr --resolution 8 --samples 1 --step 50 --pigment pigment.csv "
     "--material keratin", ".exr .png"),
    ("brdf-map t.exr --resolution 8 --samples 1 --step 50 --layers layers.toml", ".exr"),
    ("evaluate recipe.toml --positions 0 --step 50 --angle-step 5", ".png .csv .npz"),
    ("spectrum t.exr --material keratin --pigment pigment.csv --step 50", ".csv .png"),
    ("spectrum recipe.toml --step 100", ".csv .png"), ("spectrum orders.nc --step 100", ".csv"),
    ("spectrum h.npy --treatments treatments.toml --step 100 " + SMALL, ".csv"),
    ("tangents mesh.ply", ".ply"), ("precompute recipe.toml", ".exr"),
    (f"precompute h.npy {HEIGHTS}", ".exr"),
    (f"precompute scale.png {HEIGHTS} --max-height 0.1", ".exr"),
    ("orders orders.nc --theta 0 --wavelength 500", ".csv"), ("tonemap sky.exr", ".png"),
    (f"sweep light-angle h.npy {HEIGHTS} --resolution 8 --step 100", ".png .csv"),
    ("export-bsdf t.exr --theta 0 --wavelength 550 --resolution 8 --format bird", ".brdf"),
    ("export-shader t.exr --method fast", "diffraction.glsl"), ("hologram logo.png", "ring.xml"),
    ("scatter h.npy --pixel-size 0.1 --coherence-width 2", ".csv .png"),
    ("survey recipe.toml --resolution 8 -m llvm_ad_rgb", "samples.csv"),
    ("export-osl t.exr --name a --material Al", "a.osl"),
    ("solve profile.txt --period 0.6 --theta 0 --wavelength-range 500:500 --material Al", ".nc"),
]  # fmt: skip
#: Commands that take long, and are refused before their work.
SLOW = [
    ("compare scale.xml", "compare.json"), ("export-viewer scale.xml", ".html"),
    ("tradeoff h.npy --pixel-size 0.1", "depth.png"), ("view scale.xml", ".html"),
]  # fmt: skip
#: Commands without a file as their output.
NONE = {"info", "presets"}


def inputs_of(command: str, folder: Path) -> list[str]:
    """Files of a folder that a command reads: those in its words first, then what these name."""
    words = [word for part in shlex.split(command) for word in part.replace("=", ",").split(",")]
    read = [word for word in words if (folder / word).is_file()]
    return [*read, *(name for word in read for name in NAMED.get(word, ()))]


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
