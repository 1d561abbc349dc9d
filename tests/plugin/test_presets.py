"""Named looks: records that become BSDFs of the plugin."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.files import FileKind, kind_of
from mitsuba_diffraction.heights import Source
from mitsuba_diffraction.plugin.parameters import NAMES
from mitsuba_diffraction.plugin.presets import find_preset, presets
from tests.support.lanes import refusal
from tests.support.scenes import gentle_patch

PRESETS = presets()


@pytest.mark.parametrize("name", PRESETS)
def test_every_record_has_a_patch_and_parameters_of_its_plugin(name):
    look = PRESETS[name]
    assert look.about
    assert set(look.parameters) <= set(NAMES[look.plugin])
    if kind_of(look.patch) is not FileKind.ORDERS:
        assert Source.of(look.patch).generator


@pytest.mark.parametrize(
    ("wrong", "near"),
    [("cdd", "did you mean cd"), ("snak", "snake"), ("FOIL", "-foil"), ("", "cd, dvd")],
)
def test_an_unknown_name_is_answered_with_the_nearest(wrong, near):
    with pytest.raises(DiffractionError, match=near):
        find_preset(wrong)


def test_changes_replace_the_whole_material_of_a_look():
    changed = md.preset("snake", int_ior=1.6, orientation=None)
    assert changed["int_ior"] == 1.6
    assert "material" not in changed
    assert "orientation" not in changed
    assert changed["pigment"] == md.preset("snake")["pigment"]


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "scalar_spectral"])
def test_the_plugin_is_the_bsdf_of_the_dictionary(variant):
    mi.set_variant(variant)
    xml = """<bsdf version="3.0.0" type="diffraction_preset" id="disc">
        <string name="preset" value="dvd"/><float name="orientation" value="90"/></bsdf>"""
    bsdf = mi.load_string(xml)
    assert bsdf.id() == "disc"
    assert str(bsdf) == str(mi.load_dict(md.preset("dvd", orientation=90)))
    assert "orientation = 90" in str(bsdf)


def test_the_plugin_names_what_is_wrong():
    mi.set_variant("llvm_ad_spectral")
    with pytest.raises(RuntimeError, match="did you mean dvd"):
        mi.load_dict({"type": "diffraction_preset", "preset": "dvdd"})
    with pytest.raises(RuntimeError, match="preset is missing"):
        mi.load_dict({"type": "diffraction_preset"})
    with pytest.raises(RuntimeError, match="'presets'; did you mean preset"):
        mi.load_dict({"type": "diffraction_preset", "presets": "dvd"})


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["cd", "gold-foil", "dichroic-film", "snake"])
def test_a_look_is_mixed_and_coated_or_refused_in_one_line(name: str, tmp_path: Path) -> None:
    mi.set_variant("llvm_ad_mono")
    solved = kind_of(find_preset(name).patch) is FileKind.ORDERS
    own: dict[str, Any] = (
        {} if solved else {"filename": gentle_patch(tmp_path)["patch"], "pixel_size": 0.05}
    )
    mixed = {"type": "diffraction_mix", "look": md.preset(name, **own), "rest": {"type": "diffuse"}}
    assert "Diffraction" in str(mi.load_dict({**mixed, "weight_look": 0.5}))
    coated = md.preset(name, coat_ior=1.4, **own)
    if not solved and "film_ior" not in coated:
        assert "1.4" in str(mi.load_dict(coated))
        return
    assert "coat_ior" in refusal(lambda: mi.load_dict(coated))
