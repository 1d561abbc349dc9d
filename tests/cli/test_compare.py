"""`compare`: pictures, a sheet and numbers, or one line."""

from __future__ import annotations

import json
from pathlib import Path

import OpenEXR
import pytest
from PIL import Image

from docs.make.figures import tables
from mitsuba_diffraction import DiffractionError, DiffractionTable, glsl, gratings
from mitsuba_diffraction.cli.console import Bar
from mitsuba_diffraction.scene import load_scene, passes, set_variant
from tests.support.coarse import little_light

pytestmark = pytest.mark.thorough

SCENE = """<scene version="3.5.0">
  <sensor type="perspective"><float name="fov" value="30"/>
    <transform name="to_world"><lookat origin="0,-3,4" target="0,0,0" up="0,0,1"/></transform>
    <film type="hdrfilm">
      <integer name="width" value="40"/><integer name="height" value="32"/>
    </film>
  </sensor>
  <integrator type="path"/>
  <shape type="rectangle" id="plate">
    <bsdf type="diffraction">
      <string name="filename" value="grating.exr"/>
      <bsdf type="diffuse"><spectrum name="reflectance" value="0.2"/></bsdf>
    </bsdf>
  </shape>
  <emitter type="directional"><vector name="direction" value="0.15, -0.5, -1"/></emitter>
</scene>
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A plate and its table, where OpenGL works."""
    pytest.importorskip("moderngl")
    pytest.importorskip("flip_evaluator")
    folder = tmp_path_factory.mktemp("plate")
    grating = gratings.sinusoidal(period=1.6, depth=0.05, periods=8)
    DiffractionTable.build(grating, coherence_width=6).save(folder / "grating.exr")
    (folder / "plate.xml").write_text(SCENE)
    set_variant("llvm_ad_rgb")
    try:
        glsl.Renderer(load_scene(folder / "plate.xml", {})).release()
    except DiffractionError as error:
        if "no OpenGL" not in str(error):
            raise
        pytest.skip(str(error))
    return folder


@pytest.fixture
def scene(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, some_variant: str) -> Path:
    """The plate's scene in another folder than the current one."""
    monkeypatch.chdir(tmp_path)
    little_light(monkeypatch.setattr)  # of which a plate alone has none
    return folder / "plate.xml"


@pytest.fixture
def shares(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, str]]:
    """Shares of the work that the bar shows, and their texts."""
    found: list[tuple[float, str]] = []

    def call(self, done, total, text):
        if total:  # the scene's loading and the preparation of tables have no known length
            found.append((done / total, text))

    monkeypatch.setattr(Bar, "__call__", call)
    return found


def check_progress(shares: list[tuple[float, str]], stages: int) -> None:
    """Shares rise from 0 to the last stage, in which fragments are timed."""
    done = [share for share, _ in shares]
    assert done == sorted(done)
    assert shares[0][0] == 0.0
    assert shares[-1] == ((stages - 1) / stages, "timing fragments")


def test_pictures_a_sheet_and_numbers_are_written(run, scene, shares):
    ran = run("compare", scene, "--method", "all", "-s", 64, "--full-spp", 2, "--supersampling", 2,
              "--frames", 8).succeeded()  # fmt: skip
    check_progress(shares, 9)
    folder = Path("plate_compare")
    document = json.loads((folder / "compare.json").read_text())
    assert set(document["methods"]) == {"fast", "exact"}
    for method, entry in document["methods"].items():
        assert f"| `{method}` |" in ran.out
        channels = OpenEXR.File(str(folder / f"{method}.exr")).channels()
        assert channels["RGB"].pixels.shape[:2] == (32, 40)
        # a directional light and no more: nothing of it is drawn at random but edges
        assert entry["direct"]["pixels"] == 40 * 32
        noise = document["noise"]["delta_e_mean"] + entry["noise"]["delta_e_mean"]
        assert entry["direct"]["delta_e_mean"] < 1.5 * noise + 0.5
        assert entry["full"]["delta_e_mean"] > 0.0
        # one convex surface; two samples of the path tracer leave a few pixels to chance
        assert entry["dark_region"] < 0.05
        assert entry["frame_ms"] > 0.0
        assert (folder / f"{method}.png").stat().st_size > 10_000
    # a loop over some hundred orders against eleven texels
    times = {name: entry["fragment_ns"] for name, entry in document["methods"].items()}
    assert times["exact"] > 4.0 * times["fast"]
    assert document["driver"]
    assert (folder / "direct.exr").exists()
    assert (folder / "full.exr").exists()
    page, sheet = Path("docs/realtime.md"), Path("docs/images/realtime.jpg")
    sheet.parent.mkdir(parents=True)
    parts = ("realtime", "most", "times", "textures")
    page.write_text("".join(f"<!-- begin {n} -->\n<!-- end {n} -->\n" for n in parts), "utf-8")
    assert tables.main(["realtime", str(folder)]) == 0
    found = [f"{entry['direct']['delta_e_mean']:.2f}" for entry in document["methods"].values()]
    assert f" | {' | '.join(found)} | " in page.read_text("utf-8")
    with Image.open(sheet) as image:
        assert image.width == 1600


def test_a_method_that_does_not_suit_is_refused_before_anything_is_rendered(
    run, scene, monkeypatch
):
    monkeypatch.setattr(passes, "render_pass", lambda *_: pytest.fail("rendered"))
    # the scene's table is of powers; nmm needs heights
    line = run("compare", scene, "--method", "nmm").failed_in_one_line()
    assert "nmm" in line or "heights" in line
    assert not Path("plate_compare").exists()
