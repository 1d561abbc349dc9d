"""The contact sheet of BRDF maps."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.figures import maps
from mitsuba_diffraction import HeightField
from mitsuba_diffraction.analysis.maps import Light


@pytest.mark.usefixtures("coarse", "variant")
def test_there_is_a_map_for_each_patch_and_light():
    x = np.arange(32) * 0.0625
    fields = [
        HeightField(np.tile(0.02 * np.sin(2 * np.pi * m * x / 2.0), (32, 1)), 0.0625, name=f"{m}")
        for m in (1, 2)
    ]
    lights = (Light(0.0), Light(30.0), Light(60.0))
    figure = maps.maps_figure(fields, lights, resolution=16, step=100)
    assert len(figure.axes) == 6
    titles = [axes.get_title() for axes in figure.axes]
    assert [t.split(";")[0] for t in titles[:3]] == [f"1, {light}" for light in lights]
    assert all(t.endswith(" stops") for t in titles)
    for axes in figure.axes:
        (image,) = axes.get_images()
        assert np.asarray(image.get_array())[..., :3].max() > 0.5  # exposed so that it shows


def test_a_bad_patch_is_one_line(capsys, tmp_path):
    assert maps.main(["-o", str(tmp_path / "a.png"), "--measured", "nothing.png"]) == 1
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("maps: error: ")
    assert "nothing.png" in line
