"""Plans: light is where geometry says, tables follow, and recipes build them again."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.heights import Source
from mitsuba_diffraction.optics.colour import linear_srgb
from mitsuba_diffraction.scene.planning.light import (
    BINS,
    WAVELENGTHS,
    light_of_tables,
)
from mitsuba_diffraction.scene.planning.plan import (
    load_by_recipes,
    plan_table,
    recipe_files,
    recipe_of,
)
from tests.support.directions import polar, rough_patch

pytestmark = pytest.mark.thorough

PATCH = rough_patch((64, 64), (0.3, 0.3), 0.2, correlation=0.2)
#: |ωi + ωo| in the plane is 0.42: below Nyquist's frequency at all wavelengths.
LIGHT, VIEW = polar(25.0, 25.0), polar(5.0, -50.0)
#: A path then is some 1e-5 of the light, far below the 1e-3 that plans leave out.
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
def lit():
    """Light of the plate's only table."""
    mi.set_variant("llvm_ad_spectral")
    (light,) = light_of_tables(plate, sensor, PATHS)
    return light


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


def from_file(file, **parameters):
    """The plate with its heights from a file."""
    return plate(patch=None, filename=str(file), pixel_size="0.3", **parameters)


def tables_of(scene):
    return [shape.bsdf().table for shape in scene.shapes()]


def bounds(light, end, count):
    """Ends of the bins, from 0 to `end`, that have light."""
    bins = np.flatnonzero(light)
    return bins[0] * end / count, (bins[-1] + 1) * end / count


def test_a_plate_is_asked_for_one_direction_only(lit):
    table, (u, v, w) = lit.table, np.abs(LIGHT + VIEW)
    seen = WAVELENGTHS[:-1][lit.wavelength > 0.0]
    assert seen[0] < 380.0
    assert seen[-1] > 700.0
    k = 2e3 * np.pi / 360.0, 2e3 * np.pi / 830.0  # the largest and the least
    for light, part, end in (
        (lit.frequency.sum(axis=0), u, table.q_limit),
        (lit.frequency.sum(axis=1), v, table.q_limit),
        (lit.kappa, w, table.expansion.kappa_max),
    ):
        low, high = bounds(light, end, BINS)
        step = end / BINS
        assert k[1] * part - step <= low
        assert high <= k[0] * part + step
    # one k at a time: light at (α, β) lies on a line through 0, to a bin
    rows, columns = np.nonzero(lit.frequency)
    np.testing.assert_allclose((rows + 0.5) * u, (columns + 0.5) * v, atol=0.5 * (u + v) + 1e-3)
    # there is nothing else in the picture
    # but for the noise of two renderings
    assert lit.total == pytest.approx(1.0, abs=5e-3)
    assert lit.share == pytest.approx(1.0, abs=1e-4)
    assert lit.kappa.sum() == pytest.approx(lit.frequency.sum(), rel=1e-4)
    assert lit.wavelength.sum() == pytest.approx(lit.frequency.sum(), rel=1e-4)
    # flat: all of a pixel, and all of the plate, sees the light at one angle
    assert lit.lobe_turn == pytest.approx(0.0, abs=1e-5)


def test_its_table_ends_where_the_light_does(lit):
    planned = plan_table(lit, 1e-3)
    u, v, w = LIGHT + VIEW
    # The observer is blind below 360 nm, and 0.1 % of the light lie below some 390 nm
    shortest = 2e3 * np.pi / 360.0
    x, y = planned.table.frequency_limit
    edge = 1.0 / np.hypot(u / x, v / y)  # of the ellipse in the direction of (u, v), over |(u, v)|
    assert 0.85 * shortest < edge < 1.02 * shortest
    assert planned.table.expansion.kappa_max >= shortest * w
    assert planned.outside <= 1e-3
    assert planned.light.surfaces == ("foil",)
    assert planned.table.nbytes < 0.5 * lit.table.nbytes


def test_what_lies_beneath_has_a_share_in_the_light():
    scenes = []
    pigment = {"pigment": {"type": "diffuse", "reflectance": 0.5}}

    def load():
        scenes.append(plate(**pigment))
        return scenes[0]

    (light,) = light_of_tables(load, sensor, PATHS)
    # Mitsuba's own renderer on both, with the pigment and with nothing beneath
    brightness = [
        float((np.array(mi.render(scene, spp=512)) @ np.linalg.inv(linear_srgb(np.eye(3)))).mean())
        for scene in (plate(), scenes[0])
    ]
    # noise of some 20,000 paths
    assert light.share == pytest.approx(brightness[0] / brightness[1], rel=0.05)


def test_several_surfaces_have_light_of_their_own():
    """Two plates of different heights side by side, and one of them twice, as bright as it is."""
    other = rough_patch((64, 64), (0.3, 0.3), 0.02, correlation=0.2)
    scenes = []

    def load():
        parts = {"type": "scene", "integrator": {"type": "ptracer"}, "sensor": plate().sensors()[0]}
        parts["light"] = {"type": "directional", "direction": [float(-x) for x in LIGHT]}
        for name, patch, x in (("a", PATCH, -2.0), ("b", other, 0.0), ("c", PATCH, 2.0)):
            given = {"coherence_width": 18.0, "energy_conserving": False, "id": name}
            bsdf = {"type": "twosided", "bsdf": md.bsdf_dict(patch, **given)}
            place = mi.ScalarTransform4f().translate([x / 5.0, 0, 0]).scale([0.2, 1, 1])
            parts[f"plate {name}"] = {"type": "rectangle", "to_world": place, "bsdf": bsdf}
        scenes.append(mi.load_dict(parts))
        return scenes[-1]

    first, second = light_of_tables(load, sensor, 8 * PATHS)
    assert first.surfaces == ("a", "c")
    assert second.surfaces == ("b",)
    assert first.total + second.total == pytest.approx(1.0, abs=5e-3)
    for each in (first, second):
        assert each.share == pytest.approx(1.0, abs=1e-3)
    assert first.total > 2.0 * second.total


@pytest.mark.parametrize("coherence", ["ensemble", "patch"])
def test_a_recipe_builds_the_planned_table_again(file, tmp_path, coherence):
    (light,) = light_of_tables(lambda: from_file(file, coherence=coherence), sensor, PATHS)
    planned = plan_table(light, 1e-3)
    (output,) = recipe_files(tmp_path / "foil.toml", 1)
    recipe, comment = recipe_of(planned, "plate.xml")
    recipe.save(output, comment)
    again = Source.of(output)
    built = md.DiffractionTable.build(md.HeightField.load(output), **again.settings)
    np.testing.assert_array_equal(built.coefficients, planned.table.coefficients)
    assert built.frequency_limit == planned.table.frequency_limit
    (table,) = tables_of(load_by_recipes(lambda: from_file(file, coherence=coherence), [output]))
    assert table.coherence == coherence
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
    np.save(file.with_name("other.npy"), 0.5 * PATCH.heights)
    limited = tmp_path / "limited.toml"
    limited.write_text(
        f'source = "{file.with_name(recipe)}"\npixel_size = 0.3\ncoherence_width = 18\n'
        "frequency_limit = [6, 5]\nheight_scale_max = 1\n"
    )
    # Mitsuba wraps what a plugin raises; `scene.load` unwraps it
    with pytest.raises((DiffractionError, RuntimeError), match=says):
        load_by_recipes(lambda: from_file(file, **parameters), [limited])


def test_heights_without_a_file_have_no_recipe(lit):
    with pytest.raises(DiffractionError, match="heights of foil are an array"):
        recipe_of(plan_table(lit, 1e-3), "plate.xml")


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
            light_of_tables(lambda parts=parts: mi.load_dict(parts), sensor, 100)


def test_a_scene_in_the_dark_is_refused():
    with pytest.raises(DiffractionError, match="none of 100 paths through the scene carries light"):
        light_of_tables(lambda: plate(polar(120.0, 25.0)), sensor, 100)
