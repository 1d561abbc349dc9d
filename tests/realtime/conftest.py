"""OpenGL and a browser, both without a window."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Any

import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.realtime.glsl.context import headless_context
from tests.support.browser import BROWSERS, FLAGS, SIZE, Tab


@pytest.fixture(scope="session")
def gl() -> Iterator[Any]:
    """A moderngl context; Mesa's software rasteriser where there is no graphics card."""
    pytest.importorskip("moderngl")
    try:
        context = headless_context()
    except DiffractionError as error:
        pytest.skip(str(error))
    yield context
    context.release()


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
