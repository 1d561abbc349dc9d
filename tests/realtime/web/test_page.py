"""The page in a browser without a window draws what the desktop does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.colour import delta_e
from tests.support.pictures import picture


@pytest.fixture(scope="module")
def desktop(scene: Any) -> dict[str, NDArray[np.float32]]:
    """The desktop's pictures, by method."""
    from mitsuba_diffraction.realtime.glsl import Renderer
    from mitsuba_diffraction.realtime.glsl.context import headless_context

    pytest.importorskip("moderngl")
    try:
        context = headless_context()
    except DiffractionError as error:
        pytest.skip(str(error))
    renderer = Renderer(scene, context=context)
    found = {method: renderer.render(method, supersampling=1) for method in ("fast", "exact")}
    renderer.release()
    context.release()
    return found


def test_both_methods_draw_what_the_desktop_draws(
    page_file: Path, tab: Any, desktop: dict[str, NDArray[np.float32]]
) -> None:
    opened = tab()
    assert opened.open(page_file) == "ready", opened.page.inner_text("#message")
    for method, expected in desktop.items():
        opened.page.evaluate(f"viewer.controls.choose('{method}')")
        found = picture(opened)
        inside = (found[..., 3] == 1.0) & (expected[..., 3] == 1.0)
        assert inside.mean() > 0.9
        errors = delta_e(expected[..., :3], found[..., :3])[inside]
        # rounded tables 0.1, normals and tangents of sixteen bits
        assert np.nanmean(errors) < 0.2, method
        colour = found[inside, :3].mean(axis=0)
        np.testing.assert_allclose(colour, expected[inside, :3].mean(axis=0), rtol=5e-3)
    assert opened.said == []
    assert all(url.startswith(("file:", "blob:", "data:")) for url in opened.asked)
