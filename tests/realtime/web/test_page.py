"""The page in a browser without a window draws what the desktop does."""

from __future__ import annotations

import base64
import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.optics.display import shown
from mitsuba_diffraction.realtime.web.export import Page
from tests.support.pictures import by_methods, picture


def test_all_that_takes_long_says_how_far_it_is(
    page: Page, told: list[tuple[int, int, str]]
) -> None:
    reading, *others = told
    assert reading[:2] == (0, 0)
    assert len(others) >= 6
    assert all(0 <= done < total for done, total, _ in others)


@pytest.fixture(scope="module")
def desktop(scene: Any) -> dict[str, NDArray[np.float32]]:
    """The desktop's pictures, by method."""
    return by_methods(scene, "fast", "exact")


def test_both_methods_draw_what_the_desktop_draws(
    page_file: Path, tab: Any, desktop: dict[str, NDArray[np.float32]]
) -> None:
    opened = tab()
    assert opened.open(page_file) == "ready", opened.page.inner_text("#message")
    for method, expected in desktop.items():
        opened.page.evaluate(f"viewer.controls.change({{method: '{method}'}})")
        found = picture(opened)
        inside = (found[..., 3] == 1.0) & (expected[..., 3] == 1.0)
        assert inside.mean() > 0.9
        errors = delta_e(expected[..., :3], found[..., :3])[inside]
        # rounded tables 0.1, normals and tangents of sixteen bits
        assert np.nanmean(errors) < 0.2, method
        colour = found[inside, :3].mean(axis=0)
        np.testing.assert_allclose(colour, expected[inside, :3].mean(axis=0), rtol=5e-3)
    text = opened.page.evaluate("element('canvas').toDataURL()").partition(",")[2]
    with Image.open(io.BytesIO(base64.b64decode(text))) as canvas:
        seen = np.asarray(canvas.convert("RGB")) / 255.0
    # eight bits; the view's formulas have a test over 31 stops in tests/realtime/glsl
    np.testing.assert_allclose(seen[inside], shown(found[inside, :3], "natural"), atol=1.0 / 255.0)
    assert opened.said == []
    assert all(url.startswith(("file:", "blob:", "data:")) for url in opened.asked)
