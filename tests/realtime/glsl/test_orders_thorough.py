"""Scenes with solved orders: shaders against the path tracer."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import pytest

from mitsuba_diffraction.realtime.shader_comparison import Comparison
from mitsuba_diffraction.scene.load import load_scene
from tests.support.scenes import SCENES

pytestmark = pytest.mark.thorough


@pytest.mark.parametrize("name", ["cd", "grating"])
@pytest.mark.usefixtures("gl")
def test_scenes_look_as_path_traced(name: str, tmp_path: Path, some_variant: str) -> None:
    scene = load_scene(SCENES / f"{name}.xml", {"resx": "24", "resy": "18"})
    comparison = Comparison(
        scene, name, mi.variant(), tmp_path / "compared", spp=6144, full_spp=0, frames=256,
        supersampling=6,
    )  # fmt: skip
    whole = comparison.run(["fast"])["methods"]["fast"]["whole"]
    # a colour difference that is hard to see; about 0.5 of it is noise
    assert whole["direct"].delta_e_mean <= 1.0
