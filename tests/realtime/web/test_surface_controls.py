"""Controls of a surface in the page draw what the desktop draws of a scene with that parameter."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mitsuba_diffraction.optics.colour import delta_e
from tests.support.browser import SIZE, Tab, load_scene  # noqa: F401 - the page's size
from tests.support.pictures import by_methods, picture

pytestmark = pytest.mark.thorough

CHOOSE = """async ([name, value]) => {
    const options = [...element(name).options ?? []];
    element(name).value = options.find(({ text }) => text === value)?.value ?? value;
    element(name).dispatchEvent(new Event(options.length ? "change" : "input"));
    while (!element("busy").hidden) await new Promise((resolve) => setTimeout(resolve, 20));
}"""

ORANGE = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [1.0, 0.21586, 0.0]}}
GOLD: dict[str, Any] = {
    "int_ior": None, "pigment": None, "material": "gold",
}  # fmt: skip


@pytest.mark.parametrize(
    ("control", "value", "surface", "method", "bound"),
    [
        # rounded tables 0.1, normals and tangents of sixteen bits
        ("turn", "25", {"orientation": 55.0}, "fast", 0.2),
        ("pigment", "#ff8000", {"pigment": ORANGE}, "fast", 0.2),
        # energy is conserved for the page's own material: gold is brighter near grazing
        ("material", "gold", GOLD, "fast", 0.5),
        ("coherence", "-1", {"coherence_width": 3.0}, "exact", 0.2),
    ],
)
def test_a_control_draws_what_the_parameter_does(
    opened: Tab, control: str, value: str, surface: Any, method: str, bound: float
) -> None:
    before = picture(opened)
    opened.page.evaluate(CHOOSE, [control, value])
    assert opened.page.evaluate("viewer.drawn") == method
    found = picture(opened)
    expected = by_methods(load_scene(**surface), method)[method]
    inside = (found[..., 3] == 1.0) & (expected[..., 3] == 1.0)
    assert inside.mean() > 0.9
    errors = delta_e(expected[..., :3], found[..., :3])[inside]
    changes = delta_e(expected[..., :3], before[..., :3])[inside]
    assert np.nanmean(errors) < bound
    assert np.nanmean(changes) > 3.0 * np.nanmean(errors)
    opened.page.keyboard.press("r")
    opened.page.wait_for_function("viewer.material === null && viewer.coherence === 1")
    np.testing.assert_allclose(picture(opened), before, atol=1e-6)
