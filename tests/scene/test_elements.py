"""What a BSDF reads from its mesh is there, or is asked for in one line."""

from __future__ import annotations

import mitsuba as mi
import pytest

from mitsuba_diffraction import DiffractionError, bsdf_dict
from mitsuba_diffraction.scene.elements import check_attributes, name_of
from tests.support.directions import rough_patch
from tests.support.gentle import load

PATCH = rough_patch((30, 32), (0.08, 0.08), 0.03)
ON_SURFACE = {"coherence": "surface", "uv_scale": 10.0, "coherence_width": 2.4}

pytestmark = pytest.mark.usefixtures("variant")


def plate(name: str):
    """A triangle whose pigment is this attribute."""
    props = mi.Properties()
    texture = {"type": "mesh_attribute", "name": name}
    pigment = {"type": "diffuse", "reflectance": texture}
    props["bsdf"] = mi.load_dict({"type": "twosided", "bsdf": pigment})
    mesh = mi.Mesh("plate", 3, 1, props=props)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = [0, 0, 0, 1, 0, 0, 1, 1, 0]
    parameters["faces"] = [0, 1, 2]
    parameters.update()
    return mesh


@pytest.mark.parametrize(
    ("name", "remedy"),
    [("vertex_orientation", "the command 'tangents"), ("face_color", "add it to the mesh")],
)
def test_an_attribute_that_is_missing_is_named_with_what_to_do(name, remedy):
    with pytest.raises(DiffractionError, match=f"no attribute {name}.*{remedy}"):
        check_attributes(plate(name), "a plate")


def test_one_that_is_there_is_read():
    mesh = plate("vertex_color")
    mesh.add_attribute("vertex_color", 3, [0.2] * 9)
    check_attributes(mesh, name_of(mesh))


def test_places_need_uv_coordinates():
    mesh = plate("vertex_color")
    mesh.set_bsdf(mi.load_dict(bsdf_dict(PATCH, **ON_SURFACE)))
    with pytest.raises(DiffractionError, match="no UV coordinates, from which coherence='surface'"):
        check_attributes(mesh, name_of(mesh))


def test_a_mesh_attribute_that_is_not_positive_is_refused():
    props = mi.Properties()
    attribute = {"type": "mesh_attribute", "name": "vertex_period"}
    props["bsdf"] = load(lateral_scale=attribute, lateral_scale_max=1.0)
    mesh = mi.Mesh("plate", 3, 1, has_vertex_texcoords=True, props=props)
    mesh.add_attribute("vertex_period", 1, [0.5, 1.0, 0.0])
    with pytest.raises(DiffractionError, match="vertex_period, whose least number is 0"):
        check_attributes(mesh, name_of(mesh))
