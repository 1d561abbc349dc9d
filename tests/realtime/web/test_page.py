"""The page in a browser without a window draws what the desktop does."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from mitsuba_diffraction.optics.colour import delta_e
from mitsuba_diffraction.optics.display import shown
from tests.support.pictures import by_methods, largest_difference, picture, ramp

#: Shows linear sRGB (93, 128, 3) by the page's view, at an exposure of 1, in single precision.
SHOW = """(text) => {
    const light = new Float32Array(Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer);
    const { drawing } = viewer, { gl, shown } = drawing, [width, height] = [128, 93];
    const source = new Target(gl, width, height), target = new Target(gl, width, height);
    gl.bindTexture(gl.TEXTURE_2D, source.texture);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, width, height, gl.RGBA, gl.FLOAT, light);
    shown.use();
    shown.set({ sample_count: 1, exposure: 1, background: [0, 0, 0] });
    shown.texture("samples", source.texture);
    drawing.full(target.frame, width, height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, light);
    return btoa(Array.from(new Uint8Array(light.buffer), (x) => String.fromCharCode(x)).join(""));
}"""


def encoded(light: NDArray[np.float32]) -> str:
    """Linear sRGB with a coverage of 1 as text."""
    whole = np.concatenate([light, np.ones_like(light[..., :1])], axis=-1)
    return base64.b64encode(whole.tobytes()).decode()


def decoded(text: str) -> NDArray[np.float32]:
    return np.frombuffer(base64.b64decode(text), np.float32)


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
    text, expected_colours = opened.page.evaluate(SHOW, encoded(ramp())), shown(ramp(), "natural")
    colours = decoded(text).reshape(*expected_colours.shape[:2], 4)[..., :3]
    assert largest_difference(expected_colours, colours) < 0.5
    assert opened.said == []
    assert all(url.startswith(("file:", "blob:", "data:")) for url in opened.asked)
