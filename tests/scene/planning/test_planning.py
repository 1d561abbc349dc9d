"""Plans: paths see what geometry says, tables follow, and recipes build them again."""

from __future__ import annotations

import dataclasses

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.heights.recipes import Recipe
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.scene.planning.lookups import Lookups, quantiles, wavelengths_needed
from mitsuba_diffraction.scene.planning.plan import (
    load_by_recipes,
    load_limited,
    plan_table,
    recipe_files,
    recipe_of,
    record,
)
from mitsuba_diffraction.tables.source import TableRequest
from tests.support.directions import polar, rough_patch

# Of coarse pixels: small tables. The plugin warns of that, and this is not about that.
pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.errors.DiffractionWarning"),
]

PATCH = rough_patch((64, 64), (0.3, 0.3), 0.2, correlation=0.2)
#: |ωi + ωo| in the plane is 0.42: below Nyquist's frequency at all wavelengths.
LIGHT, VIEW = polar(25.0, 25.0), polar(5.0, -50.0)
#: A look-up then is some 1e-5 of the light, far below the 1e-3 that plans leave out.
PATHS = 20_000


def plate(light=LIGHT, patch=PATCH, **parameters):
    """A plate in the plane z = 0, seen from VIEW by parallel rays, with one distant light."""
    # without the bound of the albedo, which takes seconds for each patch
    given = {"id": "foil", "coherence_width": 18.0, "energy_conserving": False, **parameters}
    bsdf = {"type": "diffraction", **given} if patch is None else md.bsdf_dict(patch, **given)
    view = mi.ScalarTransform4f().look_at(
        origin=[float(x) for x in 5 * VIEW], target=[0, 0, 0], up=[0, 1, 0]
    )
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "sensor": {
                "type": "orthographic",
                "to_world": view @ mi.ScalarTransform4f().scale([0.5, 0.5, 1]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8},
            },
            "light": {"type": "directional", "direction": [float(-x) for x in light]},
            "plate": {"type": "rectangle", "bsdf": bsdf},
        }
    )


def sensor(scene):
    return scene.sensors()[0]


@pytest.fixture(scope="module")
def traced():
    """Paths through the plate, and the look-ups in its only table."""
    mi.set_variant("llvm_ad_spectral")
    paths, (table,) = record(plate, sensor, PATHS)
    return paths, table


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """The heights of the plate as a file."""
    file = tmp_path_factory.mktemp("heights") / "foil.npy"
    np.save(file, PATCH.heights)
    return file


@pytest.fixture(autouse=True)
def variant():
    """Other modules set others."""
    mi.set_variant("llvm_ad_spectral")


def lookups_by_hand(u, v, w, wavelength, light):
    """Look-ups whose light is all there is."""
    columns = (np.atleast_1d(np.asarray(a, float)) for a in (u, v, w, wavelength))
    xyz = np.asarray(light, float)[:, None] * np.full(3, 1.0 / 3.0)
    return Lookups(*columns, xyz, float(np.sum(light)))


def from_file(file, **parameters):
    """The plate with its heights from a file."""
    return plate(patch=None, filename=str(file), pixel_size="0.3", **parameters)


def tables_of(scene):
    return [shape.bsdf().table for shape in scene.shapes()]


def test_a_plate_is_asked_for_one_direction_only(traced):
    paths, recorded = traced
    lookups = recorded.lookups
    u, v, w = LIGHT + VIEW  # all in float32
    assert lookups.u == pytest.approx(u, abs=1e-5)
    assert lookups.v == pytest.approx(v, abs=1e-5)
    assert lookups.w == pytest.approx(w, abs=1e-5)
    k = 2e3 * np.pi / lookups.wavelength
    assert lookups.frequency == pytest.approx(k * np.hypot(u, v), rel=1e-5)
    assert lookups.kappa == pytest.approx(k * w, rel=1e-5)
    assert lookups.wavelength.min() >= 360.0
    assert lookups.wavelength.max() <= 830.0
    # there is nothing else in the picture
    assert lookups.light.sum() == pytest.approx(1.0, abs=1e-5)
    # flat: all of a pixel, and all of the plate, sees the light at one angle
    assert paths.lobe_turn == pytest.approx(0.0, abs=1e-5)


def test_its_table_ends_where_the_light_does(traced):
    planned = plan_table(traced[1], 1e-3)
    u, v, w = LIGHT + VIEW
    # The observer is blind below 360 nm, and 0.1 % of the light lie below some 390 nm
    shortest = 2e3 * np.pi / 360.0
    x, y = planned.table.frequency_limit
    edge = 1.0 / np.hypot(u / x, v / y)  # of the ellipse in the direction of (u, v), over |(u, v)|
    assert 0.85 * shortest < edge < 1.02 * shortest
    assert planned.table.expansion.kappa_max >= shortest * w
    assert planned.outside <= 1e-3
    assert planned.recorded.surfaces == ["foil"]
    assert planned.table.nbytes < 0.5 * traced[1].table.nbytes


def test_what_lies_beneath_has_a_share_in_the_light():
    scenes = []
    pigment = {"pigment": {"type": "diffuse", "reflectance": 0.5}}

    def load():
        scenes.append(plate(**pigment))
        return scenes[0]

    _, (recorded,) = record(load, sensor, PATHS)
    # Mitsuba's own renderer on both, with the pigment and with nothing beneath
    brightness = [
        float((np.array(mi.render(scene, spp=512)) @ np.linalg.inv(linear_srgb(np.eye(3)))).mean())
        for scene in (plate(), scenes[0])
    ]
    # noise of some 16,000 paths, and the brightest percent of which count less in the plan
    light = recorded.lookups.light.sum()
    assert light == pytest.approx(brightness[0] / brightness[1], rel=0.05)


def test_the_limit_is_a_quantile_of_the_light():
    light = np.full(1000, 1e-3)
    u = np.linspace(0.0, 1.0, 1000)
    nothing, one = np.zeros(1000), np.ones(1000)
    lookups = lookups_by_hand(u, nothing, one, np.full(1000, 2e3 * np.pi), light)  # k = 1
    along_x, along_y = lookups.frequency_limit(0.1, 30.0)
    # 2 % of room are added
    assert along_x == pytest.approx(1.02 * 0.90, abs=2e-3)
    # all of it lies on one axis
    assert along_y <= along_x / 8
    assert lookups.outside((along_x, along_y)) <= 0.1
    assert lookups.frequency_limit(0.1, 0.5)[0] == 0.5
    assert quantiles(u, light, [0.5]) == pytest.approx([0.5], abs=2e-3)


def test_wavelengths_that_the_eye_does_not_see_cost_no_colour():
    wavelength = np.linspace(360.0, 830.0, 471)
    xyz = response(wavelength)
    ones = np.ones(471)
    lookups = Lookups(ones, ones, ones, wavelength, xyz / xyz.sum(), 1.0)
    needed = wavelengths_needed(lookups, 1e-3)
    low, high = needed["range_nm"]
    assert 380.0 < low < 410.0
    assert 680.0 < high < 720.0
    assert needed["lost_colour"] < 0.5  # half of what an eye can just tell apart


def test_where_all_of_a_table_is_asked_for_it_stays_whole(traced):
    angle = np.linspace(0.0, 2.0 * np.pi, 360)
    u, v = 2.0 * np.cos(angle), 2.0 * np.sin(angle)  # light and view at the horizon
    ones = np.ones(360)
    lookups = lookups_by_hand(u, v, ones, 360.0 * ones, ones / 360.0)

    class Unused(TableRequest):
        def cached(self, settings):
            raise AssertionError("a table is built")

    asked = traced[1].request
    request = Unused(*(getattr(asked, each.name) for each in dataclasses.fields(asked)))
    recorded = dataclasses.replace(traced[1], lookups=lookups, request=request)
    assert plan_table(recorded, 1e-3).settings is None
    unseen = dataclasses.replace(recorded, lookups=None)
    assert plan_table(unseen, 1e-3).table is traced[1].table


def test_a_scene_is_loaded_with_the_limits_of_its_plan(traced):
    planned = plan_table(traced[1], 1e-3)
    (table,) = tables_of(load_limited(plate, [planned]))
    assert table is planned.table
    # one of other settings is none of the plan's
    (other,) = tables_of(load_limited(lambda: plate(tolerance=1e-2), [planned]))
    assert not other.limited


def test_a_recipe_builds_the_planned_table_again(file, tmp_path):
    _, (recorded,) = record(lambda: from_file(file), sensor, PATHS)
    planned = plan_table(recorded, 1e-3)
    (output,) = recipe_files(tmp_path / "foil.toml", 1)
    recipe, comment = recipe_of(planned, "plate.xml")
    recipe.save(output, comment)
    again = Recipe.load(output)
    built = md.DiffractionTable.build(md.HeightField.load(output), **again.table)
    np.testing.assert_array_equal(built.coefficients, planned.table.coefficients)
    assert built.frequency_limit == planned.table.frequency_limit
    (table,) = tables_of(load_by_recipes(lambda: from_file(file), [output]))
    assert table.digest() == planned.table.digest()


@pytest.mark.parametrize(
    ("recipe", "parameters", "says"),
    [
        ("other.npy", {}, "no surface with the heights of"),
        ("foil.npy", {"tolerance": 1e-2}, r"tolerance=0.001 of .* is 0.01 in the scene"),
        ("foil.npy", {"height_scale": 2.0}, "height_scale=2 is beyond height_scale_max=1 "),
    ],
)
def test_recipes_for_another_scene_are_refused(file, tmp_path, recipe, parameters, says):
    np.save(file.with_name("other.npy"), PATCH.heights)
    limited = tmp_path / "limited.toml"
    limited.write_text(
        f'source = "{file.with_name(recipe)}"\npixel_size = 0.3\ncoherence_width = 18\n'
        "frequency_limit = [6, 5]\nheight_scale_max = 1\n"
    )
    # Mitsuba wraps what a plugin raises; `scene.load` unwraps it
    with pytest.raises((DiffractionError, RuntimeError), match=says):
        load_by_recipes(lambda: from_file(file, **parameters), [limited])


def test_heights_without_a_file_have_no_recipe(traced):
    with pytest.raises(DiffractionError, match="heights of foil are an array"):
        recipe_of(plan_table(traced[1], 1e-3), "plate.xml")


def test_scenes_without_anything_to_plan_are_refused(tmp_path):
    file = tmp_path / "table.exr"
    md.DiffractionTable.build(PATCH, coherence_width=18.0).save(file)
    table = {"type": "diffraction", "filename": str(file), "energy_conserving": False}
    for bsdf, expected in (
        ({"type": "diffuse"}, "has no BSDF 'diffraction'"),
        ({**table, "type": "diffraction_dielectric"}, "has no BSDF 'diffraction'"),
        (table, "come from files and stay as they are"),
    ):
        parts = {"type": "scene", "ball": {"type": "sphere", "bsdf": bsdf}}
        with pytest.raises(DiffractionError, match=expected):
            record(lambda parts=parts: mi.load_dict(parts), sensor, 100)


def test_a_scene_in_the_dark_is_refused():
    with pytest.raises(DiffractionError, match="none of 100 paths through the scene carries light"):
        record(lambda: plate(polar(120.0, 25.0)), sensor, 100)
