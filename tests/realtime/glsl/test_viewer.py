"""The window without a window: what its controls do."""

from __future__ import annotations

import types
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction import DiffractionError, DiffractionTable
from mitsuba_diffraction.realtime.glsl.camera import Camera, Orbit, dragged, rotation_about
from mitsuba_diffraction.realtime.glsl.lights import Lamp

mi = pytest.importorskip("mitsuba")


def camera() -> Camera:
    view = mi.ScalarTransform4f().look_at([0, -4, 3], [0, 0, 0], [0, 0, 1])
    return Camera(np.array(view.matrix, float), 40.0, (64, 48))


def test_turning_keeps_the_distance_and_looks_at_the_point(some_variant: str) -> None:
    orbit = Orbit.start(camera(), np.zeros(3))
    for right, up in ((0.3, 0.0), (0.0, 0.2), (-1.0, -0.4)):
        turned = orbit.turned(right, up)
        assert turned.distance == pytest.approx(orbit.distance)
        ahead = turned.to_world[:3, 3] + turned.distance * turned.to_world[:3, 2]
        np.testing.assert_allclose(ahead, orbit.target, atol=1e-6)  # Mitsuba's are single
        rotation = turned.to_world[:3, :3]
        np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)
        # level: the camera's side stays horizontal
        assert turned.to_world[2, 0] == pytest.approx(0.0, abs=1e-6)


def test_turning_never_goes_over_the_top(some_variant: str) -> None:
    orbit = Orbit.start(camera(), np.zeros(3))
    for _ in range(100):
        orbit = orbit.turned(0.0, 0.1)
        assert orbit.to_world[2, 1] > 0.0


def test_moving_and_zooming_keep_the_direction(some_variant: str) -> None:
    orbit = Orbit.start(camera(), np.zeros(3))
    assert orbit.zoomed(0.5).distance == pytest.approx(0.5 * orbit.distance)
    moved = orbit.panned(0.1, 0.2)
    np.testing.assert_array_equal(moved.to_world[:3, :3], orbit.to_world[:3, :3])
    assert moved.distance == pytest.approx(orbit.distance)
    assert not np.allclose(moved.target, orbit.target)


def test_a_dragged_light_keeps_its_distance(some_variant: str) -> None:
    orbit = Orbit.start(camera(), np.array([0.0, 0.0, 0.0]))
    spectrum = (np.array([360.0, 830.0]), np.ones(2))
    sun = dragged(Lamp("sun", np.array([0.0, 0.6, 0.8, 0.0]), *spectrum), orbit, 0.4, 0.1)
    assert np.linalg.norm(sun.place[:3]) == pytest.approx(1.0)
    assert sun.place[3] == 0.0
    lamp = dragged(Lamp("lamp", np.array([3.0, 0.0, 4.0, 1.0]), *spectrum), orbit, 0.4, 0.1)
    assert np.linalg.norm(lamp.place[:3] - orbit.target) == pytest.approx(5.0)


def test_rotations_turn_counter_clockwise() -> None:
    turned = rotation_about(np.array([0.0, 0.0, 1.0]), np.pi / 2) @ [1.0, 0.0, 0.0]
    np.testing.assert_allclose(turned, [0.0, 1.0, 0.0], atol=1e-12)


@pytest.fixture
def viewer(gl: Any, some_variant: str, table: DiffractionTable, tmp_path: Path) -> Iterator[Any]:
    """A viewer of a lit plate, before it has loaded anything."""
    pytest.importorskip("moderngl_window")
    pytest.importorskip("imgui_bundle")
    from mitsuba_diffraction.realtime.glsl import viewer as module

    table.save(tmp_path / "rough.exr")
    scene = mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective", "fov": 40,
                "to_world": mi.ScalarTransform4f().look_at([0, -4, 3], [0, 0, 0], [0, 0, 1]),
            },
            "plate": {
                "type": "rectangle",
                "bsdf": {
                    "type": "diffraction", "table": str(tmp_path / "rough.exr"),
                    "energy_conserving": False,
                    "nested": {"type": "diffuse", "reflectance": 0.2},
                },
            },
            "sun": {"type": "directional", "direction": [0.1, -1.0, -0.8], "irradiance": 2.0},
        }
    )  # fmt: skip
    settings = {"mitsuba_scene": scene, "folder": tmp_path, "window_size": (96, 64), "spp": 8}
    kind = type("SceneViewer", (module.ViewerWindow,), settings)
    made = module.open_viewer(kind, ["--window", "headless", "--backend", "egl"])
    # a headless window calls all keys alike
    made.wnd.keys = types.SimpleNamespace(ACTION_PRESS="press", S="s", P="p", R="r")
    yield made
    made.on_close()
    made.wnd.destroy()
    del kind.mitsuba_scene  # moderngl-window keeps its last windows, and what they show
    gl.__enter__()  # the tests' own context is current again


def loaded(viewer: Any) -> Any:
    while viewer._loading is not None:
        viewer.on_render(0.0, 0.01)
    return viewer


def seen(viewer: Any) -> Any:
    with Image.open(viewer.screenshot()) as image:
        return np.asarray(image, float)


def test_the_mouse_turns_moves_and_drags_the_light(viewer: Any) -> None:
    loaded(viewer).on_render(0.0, 0.01)
    assert viewer.frame_ms > 0.0
    buttons = types.SimpleNamespace(left=False, right=False, middle=False)
    viewer.wnd._mouse_buttons = buttons
    before = seen(viewer)
    assert before.max() > 100
    pictures = [before]
    for name in ("left", "middle", "right"):
        setattr(buttons, name, True)
        viewer.on_mouse_drag_event(10, 10, 12, 5)
        setattr(buttons, name, False)
        pictures.append(seen(viewer))
        assert np.abs(pictures[-1] - pictures[-2]).mean() > 0.5, name
    viewer.on_mouse_scroll_event(0.0, 2.0)
    assert np.abs(seen(viewer) - pictures[-1]).mean() > 0.5
    viewer.on_key_event(viewer.wnd.keys.R, viewer.wnd.keys.ACTION_PRESS, None)
    # edges have as many samples as there were frames
    assert np.abs(seen(viewer) - before).mean() < 2.0


def test_sliders_reach_the_picture(viewer: Any) -> None:
    before = seen(loaded(viewer))
    viewer.stops = 1.0
    assert seen(viewer).mean() > 1.1 * before.mean()
    viewer.stops, viewer.scale = 0.0, 0.4
    assert np.abs(seen(viewer) - before).mean() > 0.5
    viewer.scale = 1.0
    viewer.choose("exact")
    assert viewer.method == "exact"
    # both methods show the same light
    assert np.abs(seen(viewer) - before).mean() < 2.0
    viewer.width *= 3.0
    assert np.abs(seen(viewer) - before).mean() > 0.2


def test_a_method_that_does_not_suit_is_explained_and_not_taken(viewer: Any) -> None:
    loaded(viewer).choose("flss")  # the scene names a table, which does not hold the heights
    assert viewer.method == "fast"
    assert "needs the heights" in viewer.message
    viewer.on_render(0.0, 0.01)


def test_the_view_is_path_traced_between_frames(viewer: Any, tmp_path: Path) -> None:
    loaded(viewer).on_key_event(viewer.wnd.keys.P, viewer.wnd.keys.ACTION_PRESS, None)
    while viewer.tracing is not None:
        viewer.on_render(0.0, 0.01)
    with Image.open(tmp_path / "view_path_000.png") as image:
        traced = np.asarray(image, float)
    # 8 samples are noisy, but upright, lit and in the same place
    assert np.corrcoef(traced.mean(axis=2).ravel(), seen(viewer).mean(axis=2).ravel())[0, 1] > 0.8


def test_a_window_closed_while_loading_frees_what_there_is(viewer: Any) -> None:
    viewer.on_render(0.0, 0.01)
    viewer.on_render(0.0, 0.01)
    assert viewer.renderer is not None
    viewer.on_close()
    assert viewer.renderer is None
    assert viewer._loading is None


def test_no_display_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    window = pytest.importorskip("moderngl_window")
    pytest.importorskip("imgui_bundle")
    from mitsuba_diffraction.realtime.glsl import viewer as module

    def fail(*_: object, **__: object) -> None:
        raise RuntimeError("Cannot connect\nto display")

    monkeypatch.setattr(window, "create_window_config_instance", fail)
    with pytest.raises(DiffractionError, match=r"no window could be opened \(Cannot connect to"):
        module.open_viewer(module.ViewerWindow, [])
