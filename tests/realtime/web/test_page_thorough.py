"""The page in a browser without a window: what the reader does there, and what it may lack."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.realtime.web import Viewer
from mitsuba_diffraction.realtime.web.export import MAX_BYTES, Page, make_page
from tests.support.browser import Tab
from tests.support.pictures import picture

pytestmark = pytest.mark.thorough

SIZE = (240, 180)


def test_colours_move_with_the_light_and_come_back(opened: Tab) -> None:
    def chromaticities() -> NDArray[np.float64]:
        image = picture(opened)[..., :3].astype(float)
        return image / np.maximum(image.sum(axis=-1, keepdims=True), 1e-6)

    first = chromaticities()
    opened.page.keyboard.down("Shift")
    opened.page.mouse.move(36, 120)
    opened.page.mouse.down()
    opened.page.mouse.move(66, 108, steps=4)
    opened.page.mouse.up()
    opened.page.keyboard.up("Shift")
    moved = chromaticities()
    # the camera stands still, so the ground keeps its colours; those of the roll run
    changed = np.abs(moved - first).max(axis=-1)
    assert (changed > 0.1).sum() > 40
    assert np.median(changed) < 0.02
    opened.page.keyboard.press("r")
    np.testing.assert_allclose(chromaticities(), first, atol=1e-3)


def test_the_mouse_turns_moves_and_zooms(opened: Tab) -> None:
    mouse, keyboard = opened.page.mouse, opened.page.keyboard

    def camera() -> dict[str, Any]:
        return dict(
            opened.page.evaluate("({eye: viewer.camera.eye, target: viewer.camera.target})")
        )

    def dragged(key: str | None = None) -> dict[str, Any]:
        if key:
            keyboard.down(key)
        mouse.move(60, 120)
        mouse.down()
        mouse.move(90, 130)
        mouse.up()
        if key:
            keyboard.up(key)
        return camera()

    start = camera()
    distance = np.linalg.norm(np.subtract(start["eye"], start["target"]))
    turned = dragged()
    assert np.allclose(turned["target"], start["target"])
    assert not np.allclose(turned["eye"], start["eye"], atol=0.1)
    far = np.linalg.norm(np.subtract(turned["eye"], turned["target"]))
    np.testing.assert_allclose(far, distance, rtol=1e-6)
    panned = dragged("Control")
    assert not np.allclose(panned["target"], start["target"], atol=0.1)
    mouse.wheel(0, -100)
    opened.page.wait_for_function(f"viewer.camera.distance < {0.95 * distance}")


def test_sliders_change_the_picture(opened: Tab) -> None:
    before = picture(opened)[..., :3]
    opened.page.evaluate(
        "element('heights').value = -1, element('heights').dispatchEvent(new Event('input'))"
    )
    lower = picture(opened)[..., :3]
    # half the height: about a quarter of the light in the orders
    assert np.abs(lower - before).sum() > 0.02 * before.sum()
    shown = "element('canvas').toDataURL()"
    dim = opened.page.evaluate(shown)
    opened.page.evaluate(
        "element('exposure').value = 1, element('exposure').dispatchEvent(new Event('input'))"
    )
    assert opened.page.evaluate(shown) != dim
    assert opened.page.inner_text("#exposure_value") == "+1.0 EV"


WITHOUT = """const all = WebGL2RenderingContext.prototype.{0};
    WebGL2RenderingContext.prototype.{0} = function (name) {{
        return name === {1} ? {2} : all.call(this, name);
    }}"""


@pytest.mark.parametrize(
    ("script", "words"),
    [
        ("HTMLCanvasElement.prototype.getContext = () => null", "has no WebGL 2"),
        ("WebGL2RenderingContext.prototype.getExtension = () => null", "EXT_color_buffer_float"),
        ("delete window.DecompressionStream", "cannot unpack"),
        (WITHOUT.format("getParameter", "this.MAX_TEXTURE_SIZE", "64"), "this device supports 64"),
        # as if half floats could not hold the ground's map
        (WITHOUT.format("getExtension", '"OES_texture_float_linear"', "null"),
         "linear filtering of float textures"),
    ],
)  # fmt: skip
def test_browsers_that_lack_something_are_told_so(
    page: Page, tab: Any, tmp_path: Path, script: str, words: str
) -> None:
    path, opened = tmp_path / "page.html", tab(script=script)
    text = (
        page.text.replace('"kind": "picture"', '"kind": "single"')
        if "linear" in words
        else page.text
    )
    path.write_text(text, encoding="utf-8")
    assert opened.open(path) == "failed"
    assert words in opened.page.inner_text("#message")
    assert opened.said == []


def test_a_notebook_shows_the_same_page(
    scene: Any, page: Page, tab: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("mitsuba_diffraction.realtime.web.export.make_page", lambda *_, **__: page)
    path = tmp_path / "cell.html"
    path.write_text(f"<!DOCTYPE html>{Viewer(scene, height=200)._repr_html_()}", encoding="utf-8")
    opened = tab((240, 220))
    opened.page.goto(path.as_uri())
    (frame,) = opened.page.main_frame.child_frames
    assert opened.state(frame) == "ready"
    assert frame.evaluate("viewer.drawing.height") == 200
    assert opened.said == []


def test_the_page_is_small_and_says_what_rounding_costs(page: Page) -> None:
    assert len(page.text.encode()) < MAX_BYTES
    assert list(page.loss) == ["fast", "exact"]
    for mean, most in page.loss.values():
        assert 0.0 < mean < 0.15  # nobody sees a tenth
        assert mean < most
    assert page.left_out == {}


def test_what_does_not_fit_is_left_out_from_the_last_on(
    scene: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    from mitsuba_diffraction.realtime.web import export as packing

    # the pages of the triangles alone take 0.35 MB
    monkeypatch.setattr(packing, "CODE_BYTES", MAX_BYTES - 1000)
    monkeypatch.setattr(packing, "OCTAVES", (0.0,))
    with pytest.raises(DiffractionError, match=r"is too large for a page \(exact: .*; fast: "):
        make_page(scene, bounces=False)
