"""Scenes that are quick to render, and how to read the pictures of them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image

# A sphere that fills half of a white room: every pixel in (0, 1].
SCENE = """<scene version="3.5.0">
  <default name="spp" value="4"/>
  <default name="format" value="rgb"/>
  <integrator type="path"/>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm">
      <integer name="width" value="24"/><integer name="height" value="16"/>
      <string name="pixel_format" value="$format"/>
    </film>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
  </sensor>
  <emitter type="constant"><rgb name="radiance" value="0.5"/></emitter>
  <shape type="sphere"><bsdf type="diffuse"/></shape>
</scene>
"""
QUICK = ["-m", "scalar_rgb"]


def pixels(path):
    """Colours of an EXR."""
    channels = OpenEXR.File(str(path)).channels()
    (name,) = [n for n in channels if n in ("RGB", "RGBA", "Y")]
    return channels[name].pixels


def png(path):
    """Values of a PNG, and what they mean."""
    with Image.open(path) as image:
        return np.asarray(image), image.mode


PLATE = """<scene version="3.0.0">
    <sensor type="perspective"/>
    <shape type="rectangle">
        {bsdf}
    </shape>
    <emitter type="directional"><vector name="direction" value="0.2, 0, -1"/></emitter>
</scene>"""
SKIN = """<bsdf type="diffraction">
    <string name="filename" value="grating.toml"/>
    <float name="coherence_width" value="4"/>
    <boolean name="energy_conserving" value="false"/>
</bsdf>"""
GRATING = 'generator = "sinusoidal"\n[arguments]\nperiod = 1.6\ndepth = 0.06\nperiods = 3\n'


def skin(*more: str) -> str:
    """`SKIN` with the id `skin`, and more in it."""
    named = SKIN.replace("<bsdf ", '<bsdf id="skin" ')
    return named.replace("</bsdf>", f"{''.join(more)}</bsdf>")


def scene_file(folder: Path, *elements: str) -> Path:
    """Write `scene.xml` of some elements, and the recipe of `SKIN`, into a folder."""
    (folder / "grating.toml").write_text(GRATING)
    file = folder / "scene.xml"
    file.write_text(f'<scene version="3.0.0">{"".join(elements)}</scene>')
    return file


def plate_file(folder: Path) -> Path:
    """Write the scene `plate.xml` and its recipe into a folder."""
    (folder / "grating.toml").write_text(GRATING)
    file = folder / "plate.xml"
    file.write_text(PLATE.format(bsdf=SKIN))
    return file
