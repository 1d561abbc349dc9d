"""Cameras of any scene go around what diffracts there."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.scene.load import load_scene
from mitsuba_diffraction.scene.orbit import vertical

SCENE = """<scene version="3.5.0">
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="4,-9,2" target="4,0,2" up="0,0,1"/></transform>
  </sensor>
  <shape type="sphere"><point name="center" x="4" y="1" z="2"/><bsdf type="diffuse"/></shape>
</scene>
"""


def test_a_camera_goes_around_the_middle_of_the_shapes(tmp_path: Path) -> None:
    mi.set_variant("scalar_rgb")
    (tmp_path / "ball.xml").write_text(SCENE)

    def pose(degrees: float) -> np.ndarray:
        scene = load_scene(tmp_path / "ball.xml", {"render:orbit": str(degrees)})
        return np.array(scene.sensors()[0].world_transform().matrix)

    # 10 in front of the middle (4, 1, 2), then 10 to its right, still looking at it
    assert pose(0)[:3, 3] == pytest.approx([4, -9, 2], abs=1e-5)
    assert pose(90)[:3, 3] == pytest.approx([14, 1, 2], abs=1e-5)
    assert pose(90)[:3, 2] == pytest.approx([-1, 0, 0], abs=1e-6)
    assert pose(90)[:3, 1] == pytest.approx([0, 0, 1], abs=1e-6)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("elevation", [-20, 0, 45, 60])
def test_the_vertical_is_the_axis_that_points_upwards_in_the_picture(
    axis: int, elevation: float
) -> None:
    up, ahead = np.eye(3)[axis], np.eye(3)[axis - 1]
    sin, cos = np.sin(np.radians(elevation)), np.cos(np.radians(elevation))
    assert vertical(cos * up + sin * ahead, cos * ahead - sin * up) == pytest.approx(up)
