"""A height_scale that varies over the surface is, at each point, the number that it has there."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.elements import check_attributes
from tests.support.directions import polar
from tests.support.gentle import UV, bitmap, hits, load, pairs
from tests.support.lanes import vectors

pytestmark = pytest.mark.thorough

FACTORS = np.array([[0.25, 1.25], [0.8, 0.0]], np.float32)


@pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")  # of what is taken
@pytest.mark.parametrize(
    "parameters",
    [
        {},
        {"material": "Al", "coat_ior": 1.3},
        {"energy_conserving": True},
        {"int_ior": 1.5, "pigment": {"type": "diffuse"}},
    ],
)
def test_each_place_is_as_with_the_number_that_it_has(mono, parameters):
    wi, wo, _ = pairs(60)
    # what conserves energy takes a second for each of the height scales that it is made at
    factors = (
        np.array([[1.1, 1.25], [1.0, 1.2]], np.float32)
        if "energy_conserving" in parameters
        else FACTORS
    )
    varying = load(height_scale=bitmap(factors), **parameters)
    for factor, uv in zip(factors.ravel()[:2], UV, strict=False):
        constant = load(height_scale=float(factor), **parameters)
        found = [
            bsdf.eval_pdf(mi.BSDFContext(), hits(wi, uv), vectors(wo))
            for bsdf in (varying, constant)
        ]
        dr.eval(found)  # one kernel instead of four
        (value, density), (expected, its) = ([np.array(a).ravel() for a in one] for one in found)
        # two tables of the same orders, for other κ, and energies made at other height scales
        assert value == pytest.approx(expected, rel=0.02, abs=2e-3 * float(expected.max()))
        assert density == pytest.approx(its, rel=0.05, abs=0.02 * float(its.max()))


def test_worn_smooth_it_is_a_mirror(mono):
    bsdf = load(height_scale=bitmap(FACTORS))
    si = hits(np.array([polar(0.0)]), UV[3])
    up, aside = (bsdf.eval(mi.BSDFContext(), si, vectors(polar(a)))[0][0] for a in (0.0, 20.0))
    assert aside < 1e-6 * up


def test_a_mesh_attribute_is_read(mono):
    attribute = {"type": "mesh_attribute", "name": "vertex_worn"}
    props = mi.Properties()
    props["bsdf"] = load(height_scale=attribute, height_scale_max=1.0)
    mesh = mi.Mesh("plate", 3, 1, has_vertex_texcoords=True, props=props)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = [0, 0, 0, 4, 0, 0, 0, 4, 0]
    parameters["faces"] = [0, 1, 2]
    parameters.update()
    with pytest.raises(DiffractionError, match="no attribute vertex_worn"):
        check_attributes(mesh)
    mesh.add_attribute("vertex_worn", 1, [0.5, 0.5, 0.5])
    scene = mi.load_dict({"type": "scene", "plate": mesh})
    si = scene.ray_intersect(mi.Ray3f([1.0, 1.0, 1.0], [0.0, 0.0, -1.0]))
    wo = mi.Vector3f(polar(20.0).tolist())
    found = mesh.bsdf().eval(mi.BSDFContext(), si, wo)[0][0]
    constant = load(height_scale=0.5).eval(mi.BSDFContext(), si, wo)[0][0]
    assert found == pytest.approx(constant, rel=0.01)  # two tables of the same orders
