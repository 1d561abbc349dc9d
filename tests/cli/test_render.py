"""`render` of scenes for earlier versions: what they name and is gone is said, and they go on."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.room import QUICK, SCENE, pixels


@pytest.mark.parametrize("line", ['<boolean name="second_order" value="true"/>',
                                  '<string name="layering" value="thesis"/>'])  # fmt: skip
def test_a_scene_that_names_a_retired_parameter_is_rendered(run, heights, here, line):
    name = line.split('"')[1]
    surface = f"""<bsdf type="diffraction">
      <string name="filename" value="{heights}"/><float name="coherence_width" value="6"/>
      <float name="pixel_size" value="0.08"/>
      <boolean name="energy_conserving" value="false"/>%s</bsdf>"""
    for file, parameter in (("old.xml", line), ("new.xml", "")):
        text = SCENE.replace('<bsdf type="diffuse"/>', surface % parameter)
        (here / file).write_text(text, encoding="utf-8")
        ran = run("render", file, *QUICK, "-s", "1", "-o", file.replace("xml", "exr"))
        assert ran.code == 0
        assert ran.err.count(f"{name} is no longer a parameter") == (file == "old.xml")
    # threads add the samples of a pixel in any order, in single precision
    np.testing.assert_allclose(pixels("old.exr"), pixels("new.exr"), rtol=1e-5)
