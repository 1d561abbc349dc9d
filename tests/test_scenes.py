"""The scenes: they load, render, take their parameters, and their colours follow the light."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.files import FileKind, kind_of
from mitsuba_diffraction.heights import Source
from mitsuba_diffraction.scene.parameters import parameters_of, scene_values
from tests.support.scenes import SCENES, SMALL, rendered
from tests.support.variants import use

SOLVED = (
    "cd", "cd_window", "grating", "grating_window", "laser_through_plate", "orders_on_wall",
    "spectrometer",
)  # fmt: skip
LARGE = ("sphere", "snake", "xenopeltis")
STUDIO = (
    "hologram",
    "material_ball",
    "own_mesh",
    "scales",
    "scales_macro",
    "film",
)


@pytest.mark.usefixtures("variant")
def test_two_patches_share_the_snake_s_skin(gentle: dict[str, str]) -> None:
    import mitsuba as mi

    given = SMALL | {name: gentle[name] for name in ("patch", "pixel_size")}
    skin = {"skin": "skin_two.xml", "second_patch": gentle["patch"]}
    scene = mi.load_file(str(SCENES / "snake.xml"), **given, **skin)
    values = mi.traverse(scene)
    (name,) = (name for name, _ in values if name.endswith("weight_first.data"))
    weight = values[name]
    assert np.array(weight)[[0, 32, -1], 0, 0] == pytest.approx([0.0, 1.0, 0.0])


@pytest.mark.parametrize("name", [*STUDIO, "plate", *LARGE])
def test_its_patch_is_a_recipe(name: str) -> None:
    defaults = parameters_of(SCENES / f"{name}.xml")
    assert defaults is not None
    assert Source.of(SCENES / str(defaults["patch"])).generator
    advised = {"level", "periodic", "coherence_width"}  # by messages on heights
    assert {"spp", "resx", "resy", "patch", "pixel_size", "max_height", *advised} <= set(defaults)


@pytest.mark.parametrize("name", SOLVED)
def test_its_table_has_solved_orders(name: str) -> None:
    defaults = parameters_of(SCENES / f"{name}.xml")
    assert defaults is not None
    assert kind_of(SCENES / str(defaults["table"])) is FileKind.ORDERS
    assert {"spp", "resx", "resy", "table", "coherence_width"} <= set(defaults)


def test_heights_for_a_scene_of_solved_orders_have_a_way() -> None:
    with pytest.raises(DiffractionError, match="--assign ID=FILE"):
        scene_values(SCENES / "cd.xml", {"patch": "scan.png"})


@pytest.mark.usefixtures("variant")
def test_the_patch_of_the_cd_follows_the_radius(gentle: dict[str, str]) -> None:
    """The orders ±1 of what runs along x lie in the plane of the normal and the radius."""
    import drjit as dr
    import mitsuba as mi

    file = SCENES / "meshes" / "cd_data.ply"
    bsdf = {
        "type": "diffraction",
        "filename": gentle["patch"],
        "pixel_size": gentle["pixel_size"],
        "coherence_width": float(gentle["coherence_width"]),
        "material": "none",
        "orientation": {"type": "mesh_attribute", "name": "vertex_orientation"},
    }
    scene = mi.load_dict({"type": "scene", "cd": {"type": "ply", "filename": str(file), "d": bsdf}})
    angle = np.linspace(0.0, 2 * np.pi, 41) + 0.003  # beside the edges of triangles
    radial = np.stack([np.cos(angle), np.sin(angle), 0 * angle])
    start = mi.Point3f(4.0 * radial + [[0], [0], [1]])
    ray = mi.Ray3f(start, mi.Vector3f(0, 0, -1))
    ray.wavelengths = mi.Color0f() if mi.is_rgb else 550.0
    si = scene.ray_intersect(ray)
    assert dr.all(si.is_valid())
    sine = 0.55 / 1.6  # of order 1 at normal incidence, period 1.6 µm

    def towards(direction: np.ndarray) -> np.ndarray:
        """f·cosθ in a direction of the world."""
        up = np.full(len(angle), np.sqrt(1 - sine**2))
        wo = si.to_local(mi.Vector3f(sine * direction + [[0], [0], [1]] * up))
        return np.array(si.bsdf().eval(mi.BSDFContext(), si, wo))[0]

    across = np.stack([-np.sin(angle), np.cos(angle), 0 * angle])
    for sign in (1, -1):
        order = towards(sign * radial)
        # exp(−(kσδ)²), σ = 2.5 µm: a thousandth is a patch turned by δ/sin θ = 0.18°
        np.testing.assert_allclose(order, order.mean(), rtol=1e-3)
        assert (towards(sign * across) < 1e-3 * order).all()


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


@pytest.mark.parametrize("name", ["plate", "sphere", "snake", "xenopeltis"])
@pytest.mark.usefixtures("variant")
@pytest.mark.thorough
def test_it_renders_at_its_defaults(name: str) -> None:
    image = rendered(name)
    assert image.shape == (40, 48, 3)
    assert np.isfinite(image).all()
    # shown as it is: neither black nor burnt out
    assert 0.02 < np.median(image.mean(axis=2)) < 0.8


OWN = {"patch": "{patch}", "pixel_size": "{pixel_size}"}
TRACKS = "{patch},pixel_size={pixel_size},coherence_width={coherence_width},material=Al"
#: Scenes, and parameters that take those of the gentle patch.
SMALL_SCENES = [
    *((name, OWN) for name in ("film", "hologram", "scales_macro")),
    ("snake", OWN | {"skin": "skin_two.xml", "second_patch": "{patch}"}),
]
#: The same where no kernel is compiled, which is quicker for few samples.
WITHOUT_KERNELS = [
    *((name, {}) for name in ("cd", "cd_window", "grating", "grating_window", "spectrometer")),
    ("material_ball", OWN),
    ("scales", OWN),
    ("cd", {"material:tracks": TRACKS}),
]


@pytest.mark.parametrize(
    ("variant", "name", "given"),
    [("llvm_ad_spectral", *case) for case in SMALL_SCENES]
    + [("scalar_spectral", *case) for case in WITHOUT_KERNELS],
)
@pytest.mark.thorough
def test_it_renders_small(
    variant: str, name: str, given: dict[str, str], gentle: dict[str, str]
) -> None:
    use(variant)
    own = {key: value.format(**gentle) for key, value in given.items()}
    image = rendered(name, spp="2", resx="12", resy="10", **own)
    assert image.shape == (10, 12, 3)
    assert np.isfinite(image).all()
    assert image.max() > 0.0
