"""Samples limited by an integrator around the scene's own."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.additions import CLAMP
from mitsuba_diffraction.scene.load import load_scene

# Two halves of a wall that shine: 0.5 on the left, 4 on the right. 8 pixels see their 4 m; above
# and below the left half is darkness.
SCENE = """<scene version="3.0.0">
    <integrator type="{integrator}"/>
    <sensor type="perspective"><float name="fov" value="53.130102"/>
        <transform name="to_world"><translate z="-4"/></transform>
        <film type="hdrfilm"><integer name="width" value="8"/><integer name="height" value="4"/>
            <rfilter type="box"/></film>
        <sampler type="independent"><integer name="sample_count" value="4"/></sampler></sensor>
    <shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/>
        <translate x="1"/><scale y="0.5"/></transform>
        <emitter type="area"><rgb name="radiance" value="0.5"/></emitter></shape>
    <shape type="rectangle"><transform name="to_world"><rotate y="1" angle="180"/>
        <translate x="-1"/></transform>
        <emitter type="area"><rgb name="radiance" value="4, 2, 1"/></emitter></shape>
</scene>"""


@pytest.fixture(params=["llvm_ad_rgb", "scalar_rgb"])
def scene(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    mi.set_variant(request.param)
    (tmp_path / "scene.xml").write_text(SCENE.format(integrator="path"))
    return tmp_path / "scene.xml"


def test_bright_samples_keep_their_colour_and_others_are_as_they_were(scene):
    whole, limited = (
        np.array(mi.render(load_scene(scene, values), seed=0)) for values in ({}, {CLAMP: "2"})
    )
    bright = whole.max(axis=-1) > 2
    assert 0 < bright.sum() < bright.size
    assert (whole == 0).any()
    assert limited[~bright] == pytest.approx(whole[~bright])
    assert limited[bright] == pytest.approx(whole[bright] / 2)  # 4, 2, 1 becomes 2, 1, 0.5


def test_paths_from_lamps_are_refused(scene):
    scene.write_text(SCENE.format(integrator="ptracer"))
    with pytest.raises(DiffractionError, match="leave clamping out"):
        load_scene(scene, {CLAMP: "2"})
