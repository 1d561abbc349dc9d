"""All commands that measure one scan share its table in the cache."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.tables.store import VARIABLE

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]

SCENE = """<scene version="3.0.0"><integrator type="path"/>
    <sensor type="perspective"><film type="hdrfilm"><integer name="width" value="8"/>
    <integer name="height" value="8"/></film></sensor><emitter type="constant"/>
    <shape type="sphere"><transform name="to_world"><translate z="4"/></transform>
    <bsdf type="diffraction"><string name="filename" value="scan.npy"/>
    <float name="pixel_size" value="0.1"/></bsdf></shape></scene>"""


def test_render_maps_surveys_and_spectra_share_one_file(run, here, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(here / "cache"))
    x = np.arange(40) * 0.1
    np.save("scan.npy", np.tile(0.05 * np.sin(np.pi * x), (30, 1)))
    (here / "scene.xml").write_text(SCENE)
    scan = "scan.npy", "--pixel-size", "0.1"
    for command in (
        ("render", "scene.xml", "-o", "picture.exr", "--spp", "1"),
        ("brdf-map", *scan, "-o", "map.png", "--resolution", "16"),
        ("survey", *scan, "-o", "survey"),
        # in light that Mitsuba renders; a wider range is another table
        ("spectrum", *scan, "-o", "s.csv", "--light", "45", "--detector", "0",
         "--wavelength-range", "400:700", "--step", "50"),
    ):  # fmt: skip
        assert run(*command).code == 0
        assert len(list((here / "cache").glob("table-*"))) == 1, command[0]
