"""Films with a band for each receptor, against integrals of the reference."""

from __future__ import annotations

import math

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.scene.bands import Bands
from mitsuba_diffraction.scene.load import load_scene
from tests.support.directions import polar, rough_patch

pytestmark = pytest.mark.thorough

PIXEL, LIGHT, CAMERA = 0.06, (35.0, 20.0), (25.0, 220.0)
SCENE = """<scene version="3.0.0">
    <integrator type="path"/>
    <sensor type="orthographic">
        <transform name="to_world">
            <scale value="0.01"/>
            <lookat origin="{camera}" target="0, 0, 0" up="0, 0, 1"/>
        </transform>
        <sampler type="independent"/>
        <film type="hdrfilm">
            <integer name="width" value="4"/>
            <integer name="height" value="4"/>
            <rfilter type="box"/>
        </film>
    </sensor>
    <shape type="rectangle">
        <bsdf type="diffraction">
            <string name="heightfield" value="{heights}"/>
            <string name="pixel_size" value="{pixel}"/>
            <string name="periodic" value="none"/>
            <string name="level" value="none"/>
        </bsdf>
    </shape>
    <emitter type="directional">
        <vector name="direction" value="{towards}"/>
        <spectrum name="irradiance" value="300:1, 830:1"/>
    </emitter>
</scene>"""


def _text(vector):
    return ", ".join(f"{x:.9f}" for x in vector)


@pytest.fixture
def scene(tmp_path):
    """A rough surface in light as strong at every wavelength."""
    field = rough_patch((48, 48), (PIXEL, PIXEL), 0.02)
    np.save(tmp_path / "heights.npy", field.heights)
    camera, towards = 5.0 * polar(*CAMERA), -polar(*LIGHT)
    text = SCENE.format(
        camera=_text(camera), towards=_text(towards), heights="heights.npy", pixel=PIXEL
    )
    (tmp_path / "scene.xml").write_text(text)
    return field, tmp_path / "scene.xml"


def test_a_band_of_ultraviolet_is_the_reference_s_integral(scene):
    mi.set_variant("llvm_ad_spectral")
    field, file = scene
    nodes = np.arange(300.0, 701.0)
    spans = {"uv": (310.0, 340.0), "green": (520.0, 560.0)}
    bands = Bands(
        nodes.tolist(),
        {name: ((nodes >= a) & (nodes <= b)).astype(float).tolist()
         for name, (a, b) in spans.items()},
    )  # fmt: skip
    assert bands.first == 309.0
    loaded = load_scene(file, {}, bands=bands)
    picture = np.array(mi.render(loaded, spp=8192))
    assert picture.shape == (4, 4, 2)
    cosine = math.cos(math.radians(LIGHT[0]))
    for channel, (a, b) in enumerate(spans.values()):
        # trapezoids of the response, whose edges fall over 1 nm
        lam = np.arange(a - 1.0, b + 1.25, 0.25)
        f = [md.reference.brdf(field, polar(*LIGHT), polar(*CAMERA), x, eta=1.5)[0] for x in lam]
        response = np.interp(lam, [a - 1.0, a, b, b + 1.0], [0.0, 1.0, 1.0, 0.0])
        expected = cosine * np.trapezoid(np.array(f) * response, lam)
        # 1 %: the table's tolerance, and half a million wavelengths at random
        assert picture[..., channel].mean() == pytest.approx(expected, rel=0.01)


def test_tables_that_begin_at_longer_wavelengths_are_refused(scene, tmp_path):
    mi.set_variant("llvm_ad_spectral")
    field, file = scene
    md.DiffractionTable.build(field).save(tmp_path / "table.exr")
    text = file.read_text()
    first, last = text.index('<string name="heightfield"'), text.index("</bsdf>")
    file.write_text(f'{text[:first]}<string name="table" value="table.exr"/>{text[last:]}')
    with pytest.raises(md.DiffractionError, match="begins at 360 nm"):
        load_scene(file, {}, bands=Bands([300.0, 350.0, 400.0], {"u": [0.0, 1.0, 0.0]}))
    load_scene(file, {}, bands=Bands([400.0, 450.0, 500.0], {"s": [0.0, 1.0, 0.0]}))
