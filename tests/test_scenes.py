"""The scenes: they load, render, take their parameters, and their colours follow the light."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

SCENES = Path(__file__).resolve().parent.parent / "scenes"
SUNNY = ("sphere", "snake", "xenopeltis")
SMALL = {"spp": "4", "resx": "48", "resy": "40"}

# the look-alikes are as steep as the real scales, which the package says every time
pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")


def _render(name: str, **parameters: str) -> np.ndarray:
    import mitsuba as mi

    scene = mi.load_file(str(SCENES / f"{name}.xml"), **(SMALL | parameters))
    return np.array(mi.render(scene, seed=1))


@pytest.mark.parametrize("name", ["plate", *SUNNY])
@pytest.mark.usefixtures("variant")
def test_it_renders_at_its_defaults(name: str) -> None:
    image = _render(name)
    assert image.shape == (40, 48, 3)
    assert np.isfinite(image).all()
    # shown as it is: neither black nor burnt out
    assert 0.02 < np.median(image.mean(axis=2)) < 0.8


@pytest.mark.usefixtures("variant")
def test_the_snake_fills_half_of_the_picture() -> None:
    import mitsuba as mi

    scene = mi.load_file(str(SCENES / "snake.xml"), **SMALL)
    depth = mi.load_dict({"type": "aov", "aovs": "shape:shape_index"})
    index = np.array(mi.render(scene, integrator=depth, spp=4))[..., 0]
    ground = [shape.id() for shape in scene.shapes()].index("ground")
    assert (np.abs(index - ground) > 0.5).mean() > 0.5


@pytest.mark.parametrize(
    ("azimuth", "elevation"), [(0, 10), (120, 42), (215, 45), (-30, 80)], ids=str
)
@pytest.mark.usefixtures("variant")
def test_the_sun_stands_where_the_angles_say(azimuth: float, elevation: float) -> None:
    import drjit as dr
    import mitsuba as mi

    angles = {"sun_azimuth": str(azimuth), "sun_elevation": str(elevation)}
    scene = mi.load_file(str(SCENES / "daylight.xml"), **angles)
    sun = scene.emitters()[0]
    values = mi.traverse(sun)
    values["sky_scale"] = 0.0
    values.update()
    point = dr.zeros(mi.SurfaceInteraction3f, 256)
    point.wavelengths = 550.0
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, 256)
    sample, weight = sun.sample_direction(point, sampler.next_2d())
    towards = np.array(sample.d).reshape(3, -1)[:, np.array(weight)[0] > 0]
    mean = towards.mean(axis=1)
    a, e = np.radians([azimuth, elevation])
    expected = [np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)]
    # a tenth of the sun's disc, which is 0.53° wide
    assert np.degrees(np.arccos(mean @ expected / np.linalg.norm(mean))) < 0.06


@pytest.mark.usefixtures("variant")
def test_colours_move_with_the_lamp() -> None:
    """Turning the lamp by some degrees moves another part of the spectrum over the plate."""
    more = {"spp": "32", "lamp_radius": "3"}
    middle = slice(14, 26), slice(14, 34)
    blue, red = (
        _render("plate", lamp_azimuth=azimuth, **more)[middle].mean(axis=(0, 1))
        for azimuth in ("54", "46")
    )
    # the orders lie across the plate, blue nearest to the mirror direction
    assert blue[2] / blue[0] > 1.3 * red[2] / red[0]


@pytest.mark.usefixtures("variant")
def test_a_patch_of_the_user_replaces_the_default(tmp_path: Path) -> None:
    from mitsuba_diffraction import gratings

    field = gratings.sinusoidal(period=1.0, depth=0.2)
    np.save(tmp_path / "patch.npy", field.heights)
    own = {"patch": str(tmp_path / "patch.npy"), "pixel_size": str(field.pixel_size[0])}
    assert np.isfinite(_render("plate", **own)).all()
