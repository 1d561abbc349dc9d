"""Named looks among other surfaces and under a coat."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba as mi
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction.files import FileKind, kind_of
from mitsuba_diffraction.plugin.presets import find_preset
from tests.support.lanes import refusal
from tests.support.scenes import gentle_patch

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("coarse")]


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
