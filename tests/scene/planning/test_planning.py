"""Plans: paths see what geometry says, tables follow, and a plan knows what it is for."""

from __future__ import annotations

import dataclasses
import json
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.optics.colour import linear_srgb, response
from mitsuba_diffraction.progress import silent
from mitsuba_diffraction.scene.planning.make import (
    check_light,
    draft_plan,
    find_plan,
    load_planned,
    record_scene,
    worthwhile,
)
from mitsuba_diffraction.scene.planning.plan import (
    Lookups,
    Plan,
    domain_for,
    quantiles,
    wavelengths_needed,
)
from tests.support.directions import polar, rough_patch

# Of coarse pixels: small tables. The plugin warns of that, and this is not about that.
pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.errors.DiffractionWarning")

PATCH = rough_patch((64, 64), (0.3, 0.3), 0.2, correlation=0.2)
#: |ωi + ωo| in the plane is 0.42: below Nyquist's frequency at all wavelengths.
LIGHT, VIEW = polar(25.0, 25.0), polar(5.0, -50.0)
#: A look-up then is some 1e-5 of the light, far below the 1e-3 that plans leave out.
PATHS = 20_000


def plate(light=LIGHT, patch=PATCH, **parameters):
    """A plate in the plane z = 0, seen from VIEW by parallel rays, with one distant light."""
    # without the bound of the albedo, which takes seconds for each patch
    given = {"id": "foil", "coherence_width": 18.0, "energy_conserving": False, **parameters}
    bsdf = md.bsdf_dict(patch, **given)
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
def looked():
    """What the plate's table is asked, without the plate: it would be in the kernels of others."""
    mi.set_variant("llvm_ad_spectral")
    loaded = record_scene(plate, sensor, PATHS)
    bsdfs = loaded.session.bsdfs
    for n, (name, bsdf) in enumerate(bsdfs):
        known = SimpleNamespace(table=bsdf.table, height_scale=mi.Float(1.0))
        bsdfs[n] = (name, known)
    return dataclasses.replace(loaded, scene=None)


@pytest.fixture(autouse=True)
def variant():
    """Other modules set others."""
    mi.set_variant("llvm_ad_spectral")


def asked_of(u, v, w, wavelength, light):
    """Look-ups by hand; the picture's light is theirs."""
    columns = (np.atleast_1d(np.asarray(a, float)) for a in (u, v, w, wavelength))
    xyz = np.asarray(light, float)[:, None] * np.full(3, 1.0 / 3.0)
    return Lookups(*columns, xyz, float(np.sum(light)))


def test_a_plate_is_asked_for_one_direction_only(looked):
    (asked,) = looked.statistics.values()
    u, v, w = LIGHT + VIEW  # all in float32
    assert asked.u == pytest.approx(u, abs=1e-5)
    assert asked.v == pytest.approx(v, abs=1e-5)
    assert asked.w == pytest.approx(w, abs=1e-5)
    k = 2e3 * np.pi / asked.wavelength
    assert asked.frequency == pytest.approx(k * np.hypot(u, v), rel=1e-5)
    assert asked.kappa == pytest.approx(k * w, rel=1e-5)
    assert asked.wavelength.min() >= 360.0
    assert asked.wavelength.max() <= 830.0
    # there is nothing else in the picture
    assert asked.light.sum() == pytest.approx(1.0, abs=1e-5)
    # flat: all of a pixel, and all of the plate, sees the light at one angle
    assert looked.traced.lobe_turn == pytest.approx(0.0, abs=1e-5)


def test_its_table_ends_where_the_light_does(looked):
    plan = draft_plan("plate", looked, 1e-3)
    (table,) = plan.tables.values()
    u, v, w = LIGHT + VIEW
    # The observer is blind below 360 nm, and 0.1 % of the light lie below some 390 nm
    shortest = 2e3 * np.pi / 360.0
    x, y = table.domain.crop
    edge = 1.0 / np.hypot(u / x, v / y)  # of the ellipse in the direction of (u, v), over |(u, v)|
    assert 0.85 * shortest < edge < 1.02 * shortest
    assert table.domain.kappa_max >= shortest * w
    assert table.domain.outside <= 1e-3
    assert table.surfaces == ["foil"]
    assert table.digest == PATCH.digest()


def test_what_lies_beneath_takes_its_share():
    pigment = {"pigment": {"type": "diffuse", "reflectance": 0.5}}
    loaded = record_scene(lambda: plate(**pigment), sensor, PATHS)
    (asked,) = loaded.statistics.values()
    # Mitsuba's own renderer on both, with the pigment and with nothing beneath
    brightness = [
        float((np.array(mi.render(scene, spp=512)) @ np.linalg.inv(linear_srgb(np.eye(3)))).mean())
        for scene in (plate(), loaded.scene)
    ]
    loaded.session.close()
    # noise of some 16,000 paths, and the brightest percent of which count less in the plan
    assert asked.light.sum() == pytest.approx(brightness[0] / brightness[1], rel=0.05)


def test_the_reach_is_a_quantile_of_the_light():
    light = np.full(1000, 1e-3)
    u = np.linspace(0.0, 1.0, 1000)
    asked = asked_of(u, np.zeros(1000), np.ones(1000), np.full(1000, 2e3 * np.pi), light)  # k = 1
    table = md.DiffractionTable.build(PATCH, coherence_width=18.0)
    domain = domain_for(asked, table, 1.0, 0.1)
    # 2 % of room are added
    assert domain.crop[0] == pytest.approx(1.02 * 0.90, abs=2e-3)
    # all of it lies on one axis
    assert domain.crop[1] <= domain.crop[0] / 8
    assert domain.kappa_max == pytest.approx(table.q_limit, rel=1e-5)
    assert domain.outside <= 0.1
    assert quantiles(u, light, [0.5]) == pytest.approx([0.5], abs=2e-3)


def test_wavelengths_that_the_eye_does_not_see_cost_no_colour():
    wavelength = np.linspace(360.0, 830.0, 471)
    xyz = response(wavelength)
    ones = np.ones(471)
    asked = Lookups(ones, ones, ones, wavelength, xyz / xyz.sum(), 1.0)
    found = wavelengths_needed(asked, 1e-3)
    low, high = found["range_nm"]
    assert 380.0 < low < 410.0
    assert 680.0 < high < 720.0
    assert found["lost_colour"] < 0.5  # half of what an eye can just tell apart


def test_turned_light_is_noticed(looked):
    plan = draft_plan("plate", looked, 1e-3)
    inside = record_scene(plate, sensor, PATHS, plan=plan, seed=1)
    (share,) = check_light(inside, plan).values()
    assert share <= 3e-3
    inside.session.close()
    del inside  # the kernels of the next are the same without it
    turned = record_scene(lambda: plate(polar(70.0, 25.0)), sensor, PATHS, plan=plan)
    with pytest.raises(DiffractionError, match=r"the plan does not fit: .* % of the light of foil"):
        check_light(turned, plan)
    turned.session.close()


def test_other_heights_and_parameters_are_refused(looked):
    plan = draft_plan("plate", looked, 1e-3)
    other = rough_patch((64, 64), (0.3, 0.3), 0.1)
    for load in (lambda: plate(patch=other), lambda: plate(tolerance=1e-2)):
        with pytest.raises(DiffractionError, match=r"not for foil: the heights or a table's"):
            load_planned(load, plan)


def test_what_saves_too_little_is_left_whole(looked):
    plan = draft_plan("plate", looked, 1e-3)
    (key,) = plan.tables
    whole = looked.session.tables[key]
    assert worthwhile(plan, {key: whole}).limits() == {}
    smaller = md.DiffractionTable.build(PATCH, coherence_width=18.0, q_max=4.0, kappa_max=20.0)
    found = worthwhile(plan, {key: smaller})
    assert set(found.limits()) == {key}
    assert found.tables[key].memory == (whole.nbytes, smaller.nbytes)


def test_where_all_of_a_table_is_asked_for_nothing_is_built(looked):
    (key,) = looked.session.tables
    angle = np.linspace(0.0, 2.0 * np.pi, 360)
    u, v = 2.0 * np.cos(angle), 2.0 * np.sin(angle)  # light and view at the horizon
    ones = np.ones(360)
    asked = asked_of(u, v, ones, 360.0 * ones, ones / 360.0)
    everywhere = dataclasses.replace(looked, statistics={key: asked})

    def load():
        raise AssertionError("a table is built")

    found = find_plan("plate", everywhere, load, sensor, 1e-3, silent)
    assert found.plan.limits() == {}
    assert found.difference is None
    (table,) = found.plan.tables.values()
    assert table.memory[0] == table.memory[1]


def test_scenes_without_anything_to_plan_are_refused(tmp_path):
    file = tmp_path / "table.exr"
    md.DiffractionTable.build(PATCH, coherence_width=18.0).save(file)
    table = {"type": "diffraction", "table": str(file), "energy_conserving": False}
    for bsdf, expected in (
        ({"type": "diffuse"}, "has no BSDF 'diffraction'"),
        (table, "come from files and stay as they are"),
    ):
        parts = {"type": "scene", "ball": {"type": "sphere", "bsdf": bsdf}}
        with pytest.raises(DiffractionError, match=expected):
            record_scene(lambda parts=parts: mi.load_dict(parts), sensor, 100)


def test_a_sheet_that_lets_light_through_is_refused():
    with pytest.raises(DiffractionError, match="light goes through foil, which plans do not"):
        record_scene(lambda: plate(thin=True), sensor, 100)


def test_a_scene_in_the_dark_is_refused():
    with pytest.raises(DiffractionError, match="none of 100 paths through the scene carries light"):
        record_scene(lambda: plate(polar(120.0, 25.0)), sensor, 100)


def test_a_plan_comes_back_from_its_file(looked, tmp_path):
    plan = draft_plan("plate", looked, 1e-3)
    file = tmp_path / "plan.json"
    plan.save(file)
    assert Plan.load(file) == plan


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("no JSON", "it is no JSON"),
        ("[1]", "JSON but no plan"),
        ('{"kind": "mitsuba-diffraction plan", "version": 99}', "a plan of version 99"),
        ('{"kind": "mitsuba-diffraction plan", "version": 2}', "a damaged plan"),
    ],
)
def test_files_that_are_no_plan_are_refused_in_one_line(tmp_path, text, says):
    file = tmp_path / "plan.json"
    file.write_text(text)
    with pytest.raises(DiffractionError, match=says) as caught:
        Plan.load(file)
    assert "\n" not in str(caught.value)


def test_a_plan_with_a_domain_of_nothing_is_damaged(looked, tmp_path):
    file = tmp_path / "plan.json"
    draft_plan("plate", looked, 1e-3).save(file)
    document = json.loads(file.read_text())
    next(iter(document["tables"].values()))["domain"]["crop"] = [-1.0, 1.0]
    file.write_text(json.dumps(document))
    with pytest.raises(DiffractionError, match="damaged plan"):
        Plan.load(file)
