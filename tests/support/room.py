"""A scene that is quick to render, and how to read the pictures of it."""

from __future__ import annotations

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
