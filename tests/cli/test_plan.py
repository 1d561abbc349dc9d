"""`plan` and `render --plan`: less memory, the same picture, and one line where it does not fit."""

from __future__ import annotations

import functools
import json

import numpy as np
import OpenEXR
import pytest

from mitsuba_diffraction.optics.colour import linear_srgb
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough

# A plate seen from above in light from 20°, with next to no sky.
SCENE = """<scene version="3.5.0">
  <default name="elevation" value="70"/>
  <default name="heights" value="heights.npy"/>
  <integrator type="path"><integer name="max_depth" value="3"/></integrator>
  <sensor type="orthographic">
    <transform name="to_world">
      <scale value="0.5"/><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="12"/><integer name="height" value="8"/>
      <string name="component_format" value="float32"/>
    </film>
    <sampler type="independent"><integer name="sample_count" value="64"/></sampler>
  </sensor>
  <emitter type="directional">
    <transform name="to_world">
      <rotate y="1" angle="90"/><rotate y="1" angle="$elevation"/>
    </transform>
  </emitter>
  <emitter type="constant"><spectrum name="radiance" value="1e-6"/></emitter>
  <shape type="rectangle">
    <bsdf type="diffraction" id="foil">
      <string name="filename" value="$heights"/>
      <string name="pixel_size" value="0.3"/>
      <float name="coherence_width" value="18"/>
      <boolean name="energy_conserving" value="false"/>
      <string name="material" value="none"/>
    </bsdf>
  </shape>
</scene>
"""
PATHS = ("--paths", 20000)
#: X + Y + Z of red, green and blue.
XYZ = np.linalg.inv(linear_srgb(np.eye(3))).sum(axis=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A scene and its heights."""
    folder = tmp_path_factory.mktemp("plan")
    np.save(folder / "heights.npy", rough_patch((64, 64), (0.3, 0.3), 0.2).heights)
    (folder / "foil.xml").write_text(SCENE)
    return folder


@pytest.fixture(scope="module")
def planned(folder):
    """Report and plan."""
    from mitsuba_diffraction.cli import main

    plan, report = folder / "plan.toml", folder / "report.json"
    arguments = ["plan", folder / "foil.xml", "-o", plan, "--json", report, *PATHS]
    assert main([str(a) for a in arguments]) == 0
    return plan, json.loads(report.read_text())


@pytest.fixture(scope="module")
def picture(folder):
    """`picture(*options)`: mean colour of the scene as a function of the options of `render`."""
    from mitsuba_diffraction.cli import main

    @functools.cache
    def call(*options):
        out = folder / "picture.exr"
        words = ["render", folder / "foil.xml", "-s", 64, "-o", out, *options]
        assert main([str(word) for word in words]) == 0
        channels = OpenEXR.File(str(out)).channels()
        return np.asarray(channels["RGB"].pixels, float).mean(axis=(0, 1))

    return call


def test_the_report_says_what_is_needed_and_what_it_changes(planned):
    _, report = planned
    (table,) = report["tables"]
    assert table["surfaces"] == "foil"
    # light from 20°, view from 0°: |q| = k sin 20°, at 390 to 360 nm
    along_x, along_y = table["needs"]["frequency (rad/µm), along x and y"]
    assert 0.9 * 5.97 < along_x < 1.1 * 5.97
    assert along_y < along_x
    assert table["planned"]["memory_mb"] < 0.8 * table["whole"]["memory_mb"]
    assert table["needs"]["share of the light outside, at most"] <= report["tolerance"]
    low, high = table["asked for"]["wavelengths of 99.9 %"]["range_nm"]
    assert 360.0 < low < 420.0
    assert 650.0 < high < 720.0


def test_a_planned_picture_is_the_whole_one(picture, planned, capfd):
    # direct light is the same in all samples, the sky next to nothing; wavelengths are drawn alike
    assert picture("--plan", planned[0]).mean() == pytest.approx(picture().mean(), rel=0.01)
    assert "the table ends at the frequencies" in capfd.readouterr().err


def test_a_picture_lacks_at_most_the_share_of_light_that_the_plan_states(picture, folder):
    from mitsuba_diffraction.cli import main

    plan, report = folder / "less.toml", folder / "less.json"
    arguments = ["plan", folder / "foil.xml", "-o", plan, "--json", report, *PATHS]
    assert main([str(a) for a in (*arguments, "--plan-tolerance", 0.1)]) == 0
    (table,) = json.loads(report.read_text())["tables"]
    stated = table["needs"]["share of the light outside, at most"]
    # X + Y + Z, in which a plan weighs light, of the mean colour
    missing = 1.0 - (picture("--plan", plan) @ XYZ) / (picture() @ XYZ)
    assert 0.02 < stated <= 0.1
    # bins that the limit crosses count as outside, and lobes of the last orders reach beyond it
    assert 0.0 < missing <= stated


def test_a_plan_is_made_before_rendering(run, folder, planned):
    _, report = planned
    out = folder / "made.exr"
    ran = run("render", folder / "foil.xml", "-s", 4, "-o", out, "--plan", *PATHS).succeeded()
    now, before = (report["tables"][0][which]["memory_mb"] for which in ("planned", "whole"))
    assert f"plan: foil has a table of {now:.3g} MB instead of {before:.3g} MB" in ran.err


def test_variants_without_wavelengths_say_so_and_render(run, folder, planned):
    plan, _ = planned
    out = folder / "mono.exr"
    ran = run(
        "render", folder / "foil.xml", "-m", "llvm_ad_mono", "-s", 1, "-o", out, "--plan", plan
    ).succeeded()
    assert "warning: --plan: llvm_ad_mono looks up" in ran.err
    assert run("plan", folder / "foil.xml", "-m", "llvm_ad_mono").code == 1
