"""Which parameters a scene has, includes and all."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.scene.parameters import check_parameters, parameters_of


@pytest.fixture
def scene(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "light.xml").write_text(
        '<scene version="3.0.0"><default name="power" value="2"/>'
        '<float name="x" value="$power"/></scene>'
    )
    file = tmp_path / "scene.xml"
    file.write_text(
        '<scene version="3.0.0"><default name="spp" value="16"/><default name="part" '
        'value="light"/><include filename="parts/$part.xml"/>'
        '<string name="n" value="a $needed b"/></scene>'
    )
    return file


def test_defaults_and_uses_are_found_in_includes_too(scene):
    assert parameters_of(scene) == {"spp": "16", "part": "light", "power": "2", "needed": None}


def test_an_unknown_parameter_is_answered_with_those_there_are(scene):
    with pytest.raises(DiffractionError) as caught:
        check_parameters(scene, {"sp": "4"})
    text = str(caught.value)
    assert "no parameter 'sp'; it has (with defaults) spp=16, part=light" in text
    assert text.endswith("did you mean spp?")
    assert "\n" not in text


def test_known_parameters_pass(scene):
    check_parameters(scene, {"spp": "1", "needed": "x"})


def test_a_given_value_chooses_the_include(scene):
    (scene.parent / "parts" / "other.xml").write_text(
        '<scene version="3.0.0"><default name="colour" value="red"/></scene>'
    )
    assert "colour" in parameters_of(scene, {"part": "other"})


def test_a_scene_without_parameters_says_so(tmp_path):
    file = tmp_path / "plain.xml"
    file.write_text('<scene version="3.0.0"/>')
    with pytest.raises(DiffractionError, match="has no parameters"):
        check_parameters(file, {"spp": "1"})


def test_a_circle_of_includes_ends(tmp_path):
    file = tmp_path / "circle.xml"
    file.write_text('<scene version="3.0.0"><include filename="circle.xml"/></scene>')
    assert parameters_of(file) is None


@given(st.binary(max_size=200))
def test_any_file_is_left_to_mitsuba_if_it_is_no_xml(tmp_path_factory, content):
    file = tmp_path_factory.mktemp("any") / "scene.xml"
    file.write_bytes(content)
    check_parameters(file, {"spp": "1"}) if parameters_of(file) is None else None
