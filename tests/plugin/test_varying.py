"""Parameters that vary over a surface have, at each point, the values of the number there."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import polar
from tests.support.gentle import UV, bitmap, directions, hits, load, pairs
from tests.support.lanes import vectors

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.usefixtures("mono"),
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning"),
]

FACTORS = (0.25, 1.25, 0.8, 0.0)
#: What conserves energy takes a second for each of the height scales that it is made at.
GENTLE = {"height_scale": (1.1, 1.25, 1.0, 1.2)}
FILM = {"eta": 0.9, "k": 6.0, "film_ior": 1.6}
#: Numbers of four texels, and other parameters.
CASES = {
    "heights": ({"height_scale": FACTORS}, {}),
    "heights under a coat": ({"height_scale": FACTORS}, {"material": "Al", "coat_ior": 1.3}),
    "heights, scaled energy": (GENTLE, {"energy_conserving": True}),
    "heights over pigment": ({"height_scale": FACTORS}, {"int_ior": 1.5, "pigment": "grey"}),
    "lengths": ({"lateral_scale": (0.6, 1.3, 0.8, 1.0)}, {}),
    "directions": ({"orientation": (0.0, 90.0, 200.0, 40.0)}, {}),
    "films": ({"film_thickness": (100.0, 400.0, 200.0, 300.0)}, FILM),
}


def texture(name, numbers):
    """The parameter as a texture of four texels."""
    if name == "orientation":
        return {name: directions(numbers)}
    texels = np.reshape(numbers, (2, 2)).astype(np.float32)
    if name == "film_thickness":
        return {name: bitmap(texels / 400.0), "film_thickness_max": 400.0}
    return {name: bitmap(texels)}


@pytest.mark.parametrize("case", CASES)
def test_each_place_is_as_with_the_number_that_it_has(case):
    varied, fixed = CASES[case]
    ((name, numbers),) = varied.items()
    wi, wo, _ = pairs(60)
    varying = load(**texture(name, numbers), **fixed)
    # lengths share a table where both have one largest factor
    largest = {"lateral_scale_max": max(numbers)} if name == "lateral_scale" else {}
    for number, uv in zip(numbers[:2], UV, strict=False):
        constant = load(**{name: number}, **largest, **fixed)
        found = [
            bsdf.eval_pdf(mi.BSDFContext(), hits(wi, uv), vectors(wo))
            for bsdf in (varying, constant)
        ]
        dr.eval(found)  # one kernel instead of four
        (value, density), (expected, its) = ([np.array(a).ravel() for a in one] for one in found)
        # two tables of the same orders, for other κ, and energies made at other height scales
        assert value == pytest.approx(expected, rel=0.02, abs=2e-3 * float(expected.max()))
        assert density == pytest.approx(its, rel=0.05, abs=0.02 * float(its.max()))


def test_worn_smooth_it_is_a_mirror():
    bsdf = load(**texture("height_scale", FACTORS))
    si = hits(np.array([polar(0.0)]), UV[3])
    up, aside = (bsdf.eval(mi.BSDFContext(), si, vectors(polar(a)))[0][0] for a in (0.0, 20.0))
    assert aside < 1e-6 * up


@pytest.mark.parametrize(
    ("name", "channels", "values", "number"),
    [("height_scale", 1, [0.5] * 3, 0.5), ("orientation", 3, [0.0, 1.0, 0.0] * 3, 90.0)],
)
def test_a_mesh_attribute_is_read(name, channels, values, number):
    attribute, props = {"type": "mesh_attribute", "name": "vertex_worn"}, mi.Properties()
    largest = {"height_scale_max": 1.0} if name == "height_scale" else {}
    props["bsdf"] = load(**{name: attribute}, **largest)
    mesh = mi.Mesh("plate", 3, 1, has_vertex_texcoords=True, props=props)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = [0, 0, 0, 4, 0, 0, 0, 4, 0]
    parameters["vertex_texcoords"] = [0, 0, 1, 0, 0, 1]
    parameters["faces"] = [0, 1, 2]
    parameters.update()
    mesh.add_attribute("vertex_worn", channels, values)
    scene = mi.load_dict({"type": "scene", "plate": mesh})
    si = scene.ray_intersect(mi.Ray3f([1.0, 1.0, 1.0], [0.0, 0.0, -1.0]))
    si.wi = mi.Vector3f(polar(30.0, 20.0).tolist())
    for azimuth in (200.0, 230.0):
        wo = mi.Vector3f(polar(25.0, azimuth).tolist())
        found = mesh.bsdf().eval(mi.BSDFContext(), si, wo)[0][0]
        constant = load(**{name: number}).eval(mi.BSDFContext(), si, wo)[0][0]
        assert found == pytest.approx(constant, rel=0.01)  # two tables of the same orders
