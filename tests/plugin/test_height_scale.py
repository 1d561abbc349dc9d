"""A height_scale that varies over the surface is, at each point, the number that it has there."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.elements import check_attributes
from tests.support.directions import polar
from tests.support.gentle import load, pairs
from tests.support.lanes import vectors

pytestmark = pytest.mark.thorough

FACTORS = np.array([[0.25, 1.25], [0.8, 0.0]], np.float32)
#: Middles of the texels.
UV = np.array([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75], [0.75, 0.75]], np.float32)


def bitmap(values=FACTORS, **more):
    """A raw bitmap of these factors, not interpolated."""
    data = mi.TensorXf(np.ascontiguousarray(values[..., None]))
    return {"type": "bitmap", "raw": True, "data": data, "filter_type": "nearest"} | more


def hits(wi, uv):
    """Surface interactions at one pair of UV coordinates."""
    si = dr.zeros(mi.SurfaceInteraction3f, len(wi))
    si.wi, si.sh_frame = vectors(wi), mi.Frame3f(mi.Normal3f(0, 0, 1))
    si.uv = mi.Point2f(*uv.tolist())
    return si


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
    bsdf = load(height_scale=bitmap())
    si = hits(np.array([polar(0.0)]), UV[3])
    up, aside = (bsdf.eval(mi.BSDFContext(), si, vectors(polar(a)))[0][0] for a in (0.0, 20.0))
    assert aside < 1e-6 * up


@pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")  # of what is taken
def test_derivatives_with_respect_to_factors_are_those_of_differences(mono):
    wi, wo, _ = pairs(60)
    bsdf = load(height_scale=bitmap(), energy_conserving=True, height_scale_max=1.5)
    parameters, si = mi.traverse(bsdf), hits(wi, UV[2])

    def total(step):
        step = mi.TensorXf(mi.Float(step), (1, 1, 1)) * mi.TensorXf(
            [[[0.0], [0.0]], [[1.0], [0.0]]]
        )
        parameters["height_scale.data"] = mi.TensorXf(FACTORS[..., None]) + step
        parameters.update()
        return dr.sum(bsdf.eval(mi.BSDFContext(), si, vectors(wo))[0])

    difference = (total(0.01) - total(-0.01))[0] / 0.02
    dr.enable_grad(step := mi.Float(0.0))
    found = total(step)
    dr.forward_from(step)
    assert dr.grad(found)[0] == pytest.approx(difference, rel=1e-2)  # its curvature and rounding


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
