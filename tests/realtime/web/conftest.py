"""A small scene with its page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mitsuba_diffraction.realtime.web.export import Page, make_page
from tests.support.browser import Tab, load_scene


@pytest.fixture(scope="module")
def scene() -> Any:
    """The page's scene: no longer than a module, for kernels hold the BSDFs of all scenes."""
    return load_scene()


@pytest.fixture(scope="session")
def told() -> list[tuple[int, int, str]]:
    """What `page` told of its progress."""
    return []


@pytest.fixture(scope="session")
def page(told: list[tuple[int, int, str]]) -> Page:
    """The scene's page, with both methods."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "mitsuba_diffraction.realtime.web.export.OCTAVES", (-1.0, 0.0)
        )  # seconds each
        # the title is the worst that a file can be called
        return make_page(
            load_scene(), title="</script><script>throw 1</script>", bounces=False,
            progress=lambda *step: told.append(step),
        )  # fmt: skip


@pytest.fixture(scope="session")
def page_file(page: Page, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page in a file."""
    path = tmp_path_factory.mktemp("page") / "scene.html"
    path.write_text(page.text, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def one(request: pytest.FixtureRequest, browser: Any, page_file: Path) -> Iterator[Tab]:
    """One page for a whole file, of the file's SIZE; `opened` sets it back."""
    tab = Tab(browser, request.module.SIZE)
    assert tab.open(page_file) == "ready", tab.page.inner_text("#message")
    yield tab
    tab.page.close()


@pytest.fixture
def opened(request: pytest.FixtureRequest, one: Tab) -> Iterator[Tab]:
    """The file's page as it was when it was opened, which says nothing."""
    width, height = request.module.SIZE
    one.page.set_viewport_size({"width": width, "height": height})
    one.page.evaluate("document.body.classList.add('folded')")
    one.page.evaluate("viewer.most = 1; viewer.controls.reset(); viewer.settled(0)")
    yield one
    assert one.said == []
