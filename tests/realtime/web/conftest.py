"""A browser without a window, and a small scene with its page."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from mitsuba_diffraction.realtime.web.export import Page, make_page
from tests.support.browser import BROWSERS, FLAGS, SIZE, Tab, load_scene


@pytest.fixture(scope="package")
def browser() -> Iterator[Any]:
    """Chromium, driven by Playwright; open, it takes a tenth of a processor even with no page."""
    api = pytest.importorskip("playwright.sync_api")
    path = next((p for p in map(shutil.which, BROWSERS) if p), None)
    if path is None:
        pytest.skip("no Chromium here: apt install chromium")
    with api.sync_playwright() as playwright:
        try:
            found = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        except api.Error as error:
            pytest.skip(f"{path} does not start: {str(error).splitlines()[0]}")
        yield found
        found.close()


@pytest.fixture(scope="module")
def scene() -> Any:
    """The page's scene: no longer than a module, for kernels hold the BSDFs of all scenes."""
    return load_scene()


@pytest.fixture(scope="session")
def page() -> Page:
    """The scene's page, with both methods."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "mitsuba_diffraction.realtime.web.export.OCTAVES", (-1.0, 0.0)
        )  # seconds each
        # the title is the worst that a file can be called
        return make_page(load_scene(), title="</script><script>throw 1</script>")


@pytest.fixture(scope="session")
def page_file(page: Page, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page in a file."""
    path = tmp_path_factory.mktemp("page") / "scene.html"
    path.write_text(page.text, encoding="utf-8")
    return path


@pytest.fixture
def tab(browser: Any) -> Iterator[Any]:
    """Opens pages: `tab(size, script, phone)`, the script running before theirs."""
    opened: list[Tab] = []

    def make(size: tuple[int, int] = SIZE, script: str = "", phone: bool = False) -> Tab:
        opened.append(Tab(browser, size, script, phone))
        return opened[-1]

    yield make
    for one in opened:
        one.page.close()
