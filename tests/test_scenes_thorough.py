"""The scenes as they are: rendered with their own patches, neither black nor burnt out."""

from __future__ import annotations

import numpy as np
import pytest

from tests.support.scenes import SCENES, SMALL, rendered

# the look-alikes are as steep as the real scales, which the package says every time
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]


@pytest.mark.parametrize("name", ["plate", "sphere", "snake", "xenopeltis"])
@pytest.mark.usefixtures("variant")
def test_it_renders_at_its_defaults(name: str) -> None:
    image = rendered(name)
    assert image.shape == (40, 48, 3)
    assert np.isfinite(image).all()
    # shown as it is: neither black nor burnt out
    assert 0.02 < np.median(image.mean(axis=2)) < 0.8


@pytest.mark.parametrize("name", ["film", "hologram", "scales_macro", "snake"])
@pytest.mark.usefixtures("variant")
def test_it_renders_with_a_gentle_patch(name: str, gentle: dict[str, str]) -> None:
    tiny = {"spp": "2", "resx": "24", "resy": "20"}
    given = tiny | {key: gentle[key] for key in ("patch", "pixel_size")}
    if name == "snake":
        given |= {"skin": "skin_two.xml", "second_patch": gentle["patch"]}
    image = rendered(name, **given)
    assert image.shape == (20, 24, 3)
    assert np.isfinite(image).all()
    assert image.max() > 0.0


@pytest.mark.parametrize(
    "name",
    ["cd", "cd_window", "grating", "grating_window", "spectrometer", "material_ball", "scales"],
)
def test_it_renders_without_kernels(name: str, gentle: dict[str, str]) -> None:
    """In the variant that compiles none, which is quicker for few samples."""
    import mitsuba as mi

    mi.set_variant("scalar_spectral")
    tiny = {"spp": "2", "resx": "12", "resy": "10"}
    if name in ("material_ball", "scales"):
        tiny |= {key: gentle[key] for key in ("patch", "pixel_size")}
    image = rendered(name, **tiny)
    assert np.isfinite(image).all()
    assert image.max() > 0.0


def test_heights_take_the_place_of_solved_orders(gentle: dict[str, str]) -> None:
    import mitsuba as mi

    mi.set_variant("scalar_spectral")
    model = "{patch},pixel_size={pixel_size},coherence_width={coherence_width},material=Al"
    tiny = {"spp": "2", "resx": "12", "resy": "10"}
    image = rendered("cd", **tiny, **{"material:tracks": model.format(**gentle)})
    assert np.isfinite(image).all()
    assert image.max() > 0.0


@pytest.mark.usefixtures("variant")
def test_the_snake_fills_half_of_the_picture() -> None:
    import mitsuba as mi

    scene = mi.load_file(str(SCENES / "snake.xml"), **SMALL)
    depth = mi.load_dict({"type": "aov", "aovs": "shape:shape_index"})
    index = np.array(mi.render(scene, integrator=depth, spp=4))[..., 0]
    ground = [shape.id() for shape in scene.shapes()].index("ground")
    assert (np.abs(index - ground) > 0.5).mean() > 0.5


@pytest.mark.usefixtures("variant")
def test_colours_move_with_the_lamp() -> None:
    """Turning the lamp by some degrees moves another part of the spectrum over the plate."""
    more = {"spp": "32", "lamp_radius": "3"}
    middle = slice(14, 26), slice(14, 34)
    blue, red = (
        rendered("plate", lamp_azimuth=azimuth, **more)[middle].mean(axis=(0, 1))
        for azimuth in ("54", "46")
    )
    # the orders lie across the plate, blue nearest to the mirror direction
    assert blue[2] / blue[0] > 1.3 * red[2] / red[0]
