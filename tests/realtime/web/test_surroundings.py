"""What surrounds a page's scene: environments, lamps that are seen, what lobes meet, bumps."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import mitsuba_diffraction as md
from mitsuba_diffraction.realtime.web.export import make_page
from tests.support.browser import SIZE, Tab
from tests.support.pictures import of_the_desktop, picture

pytestmark = pytest.mark.thorough

SAMPLES = 16


@pytest.fixture(scope="module", autouse=True)
def coarse_surroundings() -> Iterator[None]:
    """Few paths between surfaces and large cells, the same for the page and the desktop."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitsuba_diffraction.realtime.glsl.bounces._POINTS", 1 << 12)
        patch.setattr("mitsuba_diffraction.realtime.glsl.surroundings._CELLS", 1 << 18)
        yield


@pytest.fixture(scope="module")
def room(scene: Any) -> Any:
    """A disc's tracks and rough metal under a lamp and a sky that is bright on one side."""
    import mitsuba as mi

    transform = mi.ScalarTransform4f
    sky = np.full((8, 16, 3), 0.2, np.float32)
    sky[:4, :8] = [0.6, 0.9, 1.5]
    waves = np.sin(np.linspace(0.0, 40.0, 64))[:, None, None] * np.ones((1, 64, 1))
    bumps = mi.Bitmap((0.5 + 0.5 * waves).astype(np.float32))
    grating = md.gratings.sinusoidal(period=1.6, depth=0.06, periods=4)
    film = {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1]}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective", "fov": 40, "film": film,
                "to_world": transform().look_at([0, -6, 3], [0, 0, 0.9], [0, 0, 1]),
            },
            "roll": {
                "type": "cylinder", "p0": [-1.2, 0.3, 0.7], "p1": [1.2, -0.3, 0.7], "radius": 0.7,
                "bsdf": md.bsdf_dict(grating, coherence_width=6, orientation=30.0, material="Al"),
            },
            "ground": {
                "type": "rectangle", "to_world": transform().scale(5),
                "bsdf": {
                    "type": "bumpmap", "scale": 0.4,
                    "relief": {"type": "bitmap", "bitmap": bumps, "raw": True},
                    "bsdf": {"type": "roughconductor", "material": "Al", "alpha": 0.2},
                },
            },
            "lamp": {
                "type": "rectangle",
                "to_world": transform().look_at([-1.5, 2.5, 2.5], [0, 0, 0.5], [0, 0, 1])
                @ transform().scale([0.6, 0.6, 1]),
                "emitter": {"type": "area", "radiance": {"type": "rgb", "value": [9, 7, 4]}},
            },
            "sky": {"type": "envmap", "bitmap": mi.Bitmap(sky), "scale": 1.0},
        }
    )  # fmt: skip


@pytest.fixture(scope="module")
def opened(room: Any, browser: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Tab]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitsuba_diffraction.realtime.web.export.OCTAVES", (0.0,))
        page = make_page(room, methods=["fast"])
    assert page.omissions == ()
    path = tmp_path_factory.mktemp("room") / "room.html"
    path.write_text(page.text, encoding="utf-8")
    tab = Tab(browser, SIZE)
    assert tab.open(path) == "ready", tab.page.inner_text("#message")
    tab.page.evaluate("document.body.classList.add('folded')")
    yield tab
    assert tab.said == []
    tab.page.close()


@pytest.fixture(scope="module")
def expected(room: Any) -> NDArray[np.float32]:
    """The desktop's picture of all direct light and light between surfaces."""
    return of_the_desktop(room, 2 * SAMPLES, bounces=True)


def test_lobes_mirror_lamp_and_sky_as_on_the_desktop(
    opened: Tab, expected: NDArray[np.float32]
) -> None:
    found = picture(opened, shadows=True, samples=SAMPLES)
    inside = (found[..., 3] > 0.99) & (expected[..., 3] > 0.99)
    outside = (found[..., 3] < 0.01) & (expected[..., 3] < 0.01)
    for region in (inside, outside):
        assert region.mean() > 0.05
        np.testing.assert_allclose(
            found[region, :3].mean(axis=0), expected[region, :3].mean(axis=0), rtol=0.03
        )
    # each of 8 × 12 blocks, in which the noise of both is a few per cent
    blocks = [x[..., :3].reshape(8, 8, 12, 8, 3).mean(axis=(1, 3)) for x in (found, expected)]
    off = np.abs(blocks[0] - blocks[1]).sum(axis=-1) / blocks[1].sum(axis=-1)
    assert np.median(off) < 0.05


def test_a_lamp_is_seen_in_its_colour_until_another_light_is_chosen(opened: Tab) -> None:
    def pixels() -> int:
        found = picture(opened, shadows=True, samples=2)[..., :3]
        return int(np.isclose(found, [9.0, 7.0, 4.0], rtol=0.01).all(axis=-1).sum())

    assert pixels() > 20
    opened.page.evaluate("viewer.controls.change({kind: 'sun'})")
    assert pixels() == 0
    opened.page.evaluate("viewer.controls.reset()")


def test_what_moves_has_the_environment_behind_it(opened: Tab) -> None:
    still = picture(opened, shadows=True, samples=2)
    opened.page.evaluate(
        """async () => {
            viewer.share = 1;
            viewer.touch();
            await new Promise(requestAnimationFrame);
            await new Promise(requestAnimationFrame);
        }"""
    )
    text = """() => {
        const { gl, held, width, height } = viewer.drawing;
        const found = new Float32Array(4 * width * height);
        gl.bindFramebuffer(gl.FRAMEBUFFER, held.frame);
        gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, found);
        return [...found];
    }"""
    moving = np.reshape(opened.page.evaluate(text), still.shape)[::-1]
    outside = (still[..., 3] == 0.0) & (moving[..., 3] == 0.0)
    assert outside.mean() > 0.05
    np.testing.assert_allclose(moving[outside, :3], still[outside, :3], atol=0.1)
