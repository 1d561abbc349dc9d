"""Elements of a scene are named for people, with an id or without."""

from __future__ import annotations

import pytest

from mitsuba_diffraction.plugin.properties import name_of, own_id


class Element:
    """What Mitsuba's elements say of themselves."""

    def __init__(self, given, kind, text=""):
        self.given, self.kind, self.text = given, kind, text

    def id(self):
        return self.given

    def class_name(self):
        return self.kind

    def __str__(self):
        return self.text


MESH = 'PLYMesh[\n  name = "meshes/knot.ply",\n  bbox = ...'


@pytest.mark.parametrize(
    ("element", "number", "name"),
    [
        (Element("foil", "Sphere"), 3, "foil"),
        (Element("", "Sphere"), 0, "shape 1 (a sphere without id)"),
        (Element("_unnamed_3", "Sphere"), None, "a sphere without id"),
        (Element("", "AreaLight"), None, "an area light without id"),
        (Element("_unnamed_0", "PLYMesh", MESH), 1, "shape 2 (the mesh knot.ply)"),
        (Element("", "PLYMesh", "PLYMesh["), None, "a plymesh without id"),
    ],
)
def test_without_an_id_it_is_the_file_or_the_kind_and_place(element, number, name):
    assert name_of(element, number) == name


def test_ids_that_mitsuba_makes_up_are_none():
    assert [own_id(given) for given in ("foil", "_unnamed_12", "")] == ["foil", "", ""]
