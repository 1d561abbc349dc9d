"""The page as an instrument: all of the light, other lights, one wavelength, the cursor, links."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mitsuba_diffraction.optics.colour import delta_e
from tests.support.browser import Tab
from tests.support.pictures import of_the_desktop, picture

pytestmark = pytest.mark.thorough

SIZE = (240, 180)
PHONE = (390, 844)


@contextmanager
def clock_stopped(page: Any) -> Iterator[None]:
    """For a page, what moves goes on moving, however long the machine takes."""
    page.evaluate("(now => { performance.now = () => now; })(performance.now())")
    yield
    page.evaluate("() => { delete performance.now; }")


def test_all_light_is_that_of_the_desktop(scene: Any, page_file: Path, tab: Any) -> None:
    expected = of_the_desktop(scene, 4)
    opened = tab()
    assert opened.open(page_file) == "ready"
    found = picture(opened, shadows=True, samples=4)
    inside = (found[..., 3] > 0.99) & (expected[..., 3] > 0.99)
    errors = delta_e(expected[..., :3], found[..., :3])[inside]
    # rounded tables; edges of shadows fall between other texels of the maps, in a few pixels
    assert np.nanmedian(errors) < 0.3
    total = expected[inside, :3].sum(axis=0)
    np.testing.assert_allclose(found[inside, :3].sum(axis=0), total, rtol=0.02)
    # a shadow at all: what lies beneath the roll is darker than without
    lit = picture(opened, shadows=False)
    assert (found[inside, 1] < 0.5 * lit[inside, 1]).mean() > 0.02


@pytest.mark.parametrize("kind", ["lamp", "sky"])
def test_lights_in_the_scenes_place_are_about_as_bright(opened: Tab, kind: str) -> None:
    own = picture(opened, shadows=True, samples=2)[..., 1].mean()
    opened.page.evaluate(f"viewer.controls.change({{kind: '{kind}'}})")
    found = picture(opened, shadows=True, samples=2)
    assert np.isfinite(found).all()
    assert 0.2 * own < found[..., 1].mean() < 5.0 * own
    if kind != "sky":  # which has no direction
        opened.page.evaluate("viewer.lights.move(0.5, 0.2); viewer.touch()")
        moved = picture(opened, shadows=True, samples=2)
        assert np.abs(moved - found)[..., 1].mean() > 0.05 * found[..., 1].mean()


def test_one_wavelength_has_its_colour_and_its_place(opened: Tab) -> None:
    places = {}
    for nm in (480, 620):
        opened.page.evaluate(f"viewer.controls.scrub({nm})")
        colour = np.array(opened.page.evaluate("viewer.colour()"))
        image = picture(opened).astype(float)[..., :3]
        bright = image.sum(axis=-1) > 0.05 * image.sum(axis=-1).max()
        # the ground's reflectance has a colour of its own, the roll's none: some pixels at least
        shares = image[bright] / image[bright].sum(axis=1, keepdims=True)
        same = np.abs(shares - colour / colour.sum()).max(axis=1) < 0.01
        assert same.mean() > 0.3
        places[nm] = image.sum(axis=-1)
    assert opened.page.text_content("#wavelength_value") == "620 nm"
    # orders lie elsewhere, not only in another colour
    blue, red = (p / p.mean() for p in places.values())
    assert np.abs(blue - red).max() > 1.0
    opened.page.evaluate("viewer.controls.scrub(375)")
    assert opened.page.evaluate("viewer.wavelength") is None


def test_the_brdf_under_the_cursor_follows_it(opened: Tab) -> None:
    opened.page.evaluate("element('map_of').open = true; viewer.settled(1)")
    shown = "[element('map').toDataURL(), element('map_words').textContent]"
    found = []
    for x, y in ((50, 70), (70, 85)):
        opened.page.evaluate("viewer.controls.map.found = null")
        opened.page.mouse.move(x, y)
        opened.page.wait_for_function("viewer.controls.map.found")
        found.append(opened.page.evaluate(shown))
    (first, words), (second, _) = found
    assert first != second
    # the grating's own orders, along the patch's x axis
    assert re.search(r"1\.60 µm at (0|180)°", words), words
    assert re.search(r"0\.80 µm at (0|180)°", words), words
    opened.page.mouse.move(5, 175)  # the ground, which does not diffract
    opened.page.wait_for_function("element('map').hidden")
    opened.page.evaluate("element('map_of').open = false")


def test_dragging_draws_less_and_rest_draws_all(opened: Tab) -> None:
    page = opened.page
    page.evaluate(
        """() => {
            window.drawn = [];
            const report = viewer.report;
            viewer.report = (sample, count) => {
                drawn.push([sample.moving, sample.width, sample.time]);
                report(sample, count);
            };
            viewer.adapt = () => {};  // whether this machine is quick is not the question
            viewer.share = 0.9;
        }"""
    )
    page.mouse.move(40, 120)
    page.mouse.down()
    with clock_stopped(page):
        page.mouse.move(76, 120, steps=10)
        page.wait_for_function("drawn.some(([moving]) => moving)")
    page.mouse.up()
    page.evaluate("delete viewer.adapt; viewer.settled(1)")
    drawn = page.evaluate("drawn")
    moving = [width for is_moving, width, _ in drawn if is_moving]
    assert moving
    assert all(width < SIZE[0] for width in moving)
    assert drawn[-1][:2] == [False, SIZE[0]]
    # pictures get smaller while they take too long, and larger again while they do not
    shares = page.evaluate(
        """() => (viewer.share = 0.9, [400, 400, 400, 10, 10, 10].map((ms) => {
            viewer.adapt(ms);
            return viewer.share;
        }))"""
    )
    assert shares[0] > shares[1] >= shares[2]
    assert shares[2] < shares[3] < shares[4] < shares[5]


def test_triangles_get_fewer_for_good_where_pictures_are_slow(opened: Tab) -> None:
    details = opened.page.evaluate(
        """() => [[5], [400, 5], [36]].map((times) => {
            Object.assign(viewer, { share: 0.5, detail: 1, finest: 0 });
            for (const ms of times) for (let n = 0; n < 20; ++n) viewer.adapt(ms);
            return viewer.detail;
        })"""
    )
    assert details == [0, 2, 1]


def test_at_rest_nothing_is_drawn(opened: Tab) -> None:
    drawn = opened.page.evaluate(
        """async () => {
            const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
            viewer.most = 4;
            await viewer.settled();
            const { gl } = viewer.drawing;
            let drawn = 0;
            const names = ["drawArrays", "drawElements", "readPixels"];
            const own = Object.getPrototypeOf(gl);
            for (const name of names) gl[name] = (...all) => (++drawn, own[name].apply(gl, all));
            await pause(300);
            const still = [drawn, viewer.frame];
            viewer.touch();
            await viewer.settled();
            for (const name of names) delete gl[name];
            return [...still, drawn > 0];
        }"""
    )
    assert drawn == [0, None, True]


def test_a_page_that_is_closed_frees_the_graphics_cards_memory(page_file: Path, tab: Any) -> None:
    opened = tab()
    assert opened.open(page_file) == "ready"
    for persisted in ("true", "false"):  # one that may be shown again keeps it
        event = f"new PageTransitionEvent('pagehide', {{persisted: {persisted}}})"
        opened.page.evaluate(f"window.dispatchEvent({event})")
        lost = opened.page.evaluate("viewer.drawing.gl.isContextLost()")
        assert lost is (persisted == "false")


def test_a_window_of_another_size_is_filled(opened: Tab) -> None:
    opened.page.set_viewport_size({"width": 200, "height": 260})
    opened.page.wait_for_function("viewer.drawing.width === 200")
    assert picture(opened).shape == (260, 200, 4)


def test_a_link_carries_the_view(opened: Tab, page_file: Path, tab: Any) -> None:
    opened.page.evaluate(
        """() => {
            viewer.camera.orbit(0.4, 0.1);
            viewer.camera.zoom(0.8);
            viewer.lights.point = [0.2, 0.3];
            viewer.exposure = 2;
            viewer.controls.change({method: "exact", wavelength: 530});
        }"""
    )
    before = picture(opened)
    opened.page.wait_for_function("location.hash.includes('nm=530')")
    address = opened.page.url.partition("#")[2]
    other = tab(SIZE)
    other.page.goto(f"{page_file.as_uri()}#{address}")
    assert other.state(other.page) == "ready"
    np.testing.assert_allclose(picture(other), before, atol=2e-3 * before.max())
    assert other.page.text_content("#exposure_value") == "+1.0 EV"
    # whatever stands there
    other.page.goto("about:blank")
    other.page.goto(f"{page_file.as_uri()}#eye=1,2&target=x&nm=1e9&method=flss&exposure=NaN&light=")
    assert other.state(other.page) == "ready"
    assert other.page.evaluate("viewer.method") == "fast"
    assert other.said == []


def test_a_lost_context_comes_back(opened: Tab) -> None:
    before = picture(opened)
    opened.page.evaluate(
        """() => {
            window.lose = viewer.drawing.gl.getExtension("WEBGL_lose_context");
            lose.loseContext();
        }"""
    )
    state = "document.documentElement.dataset.state"
    opened.page.wait_for_function(f"{state} === 'lost'")
    assert "graphics driver stopped" in opened.page.inner_text("#message")
    opened.page.evaluate("lose.restoreContext()")
    opened.page.wait_for_function(f"{state} === 'ready'")
    assert not opened.page.is_visible("#message")
    np.testing.assert_allclose(picture(opened), before, atol=1e-5)
    opened.said[:] = [line for line in opened.said if "CONTEXT_LOST" not in line]


@pytest.mark.parametrize(
    ("pattern", "left"),
    [(r'(<script id="data"[^>]*>)[^<]*', r"\1"), (r'(<script id="data"[^>]*>.{400})[^<]*', r"\1"),
     (r'(<script id="header"[^>]*>.{400})[^<]*', r"\1")],
    ids=["none", "cut", "header"],
)  # fmt: skip
def test_a_page_without_its_data_says_so(
    page_file: Path, tab: Any, tmp_path: Path, pattern: str, left: str
) -> None:
    text, changes = re.subn(pattern, left, page_file.read_text(encoding="utf-8"))
    assert changes == 1
    path = tmp_path / "cut.html"
    path.write_text(text, encoding="utf-8")
    opened = tab()
    assert opened.open(path) == "failed"
    assert "incomplete" in opened.page.inner_text("#message")
    assert opened.said == []


def test_a_phone_shows_the_subject_and_how_to_turn_and_light_it(page_file: Path, tab: Any) -> None:
    opened = tab(PHONE, phone=True)
    assert opened.open(page_file) == "ready"
    page = opened.page
    # the picture fills the screen, which does not scroll; the hint goes after a while
    assert page.evaluate("[innerWidth, innerHeight, document.body.scrollHeight]") == [
        *PHONE, PHONE[1],
    ]  # fmt: skip
    assert page.locator("#canvas").bounding_box() == {
        "x": 0, "y": 0, "width": PHONE[0], "height": PHONE[1],
    }  # fmt: skip
    assert {"turns", "light"} <= set(page.inner_text("#hint").split())
    page.wait_for_function("getComputedStyle(element('hint')).opacity === '0'")

    def dragged() -> list[bool]:
        """Whether a drag of one finger changed the eye and the light."""
        state = "JSON.stringify([viewer.camera.eye, viewer.lights.point])"
        before = json.loads(page.evaluate(state))
        page.mouse.move(150, 400)
        page.mouse.down()
        page.mouse.move(190, 420)
        page.mouse.up()
        after = json.loads(page.evaluate(state))
        return [a != b for a, b in zip(before, after, strict=True)]

    page.evaluate("viewer.controls.change({kind: 'sun'})")
    assert dragged()[0]
    page.tap("#grip")
    assert dragged() == [False, True]
    page.tap("#grip")
    assert not page.is_visible("#body")
    page.tap("#fold")
    assert page.is_visible("#body")
    assert not page.is_visible("#grip")
    box = page.locator("#panel").bounding_box()
    assert box["height"] < PHONE[1] / 2
    assert box["y"] > PHONE[1] / 2 - 1  # a sheet at the lower end, the picture above
    assert opened.said == []
