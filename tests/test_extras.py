"""A package that is not installed is one line that names the extra which has it."""

from __future__ import annotations

import re
import sys
import tomllib

import pytest

from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.extras import optional
from tests.support import ROOT

with (ROOT / "pyproject.toml").open("rb") as file:
    EXTRAS = tomllib.load(file)["project"]["optional-dependencies"]


@pytest.mark.parametrize(
    ("module", "package"),
    [
        ("SurfaceTopography.IO", "SurfaceTopography"),
        ("distributed", "distributed"),
        ("flip_evaluator", "flip-evaluator"),
        ("imageio_ffmpeg", "imageio-ffmpeg"),
        ("moderngl", "moderngl"),
        ("pxr.Usd", "usd-core"),
        ("pyoidn", "pyoidn"),
        ("trimesh", "trimesh"),
    ],
)
def test_missing_package_names_an_extra_that_has_it(
    module: str, package: str, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(DiffractionError) as caught:
        optional(module, "'a.spm'")
    text = str(caught.value)
    assert text.startswith("'a.spm': ")
    found = re.search(r"pip install (.+) \(extra (\w+)\)", text)
    assert found, text
    named, extra = found.groups()
    assert any(re.match(rf"{package}\b", requirement) for requirement in EXTRAS[extra])
    assert f"'{package.lower()}" in named.lower()


def test_installed_package_is_the_module():
    pytest.importorskip("distributed")
    assert optional("distributed") is sys.modules["distributed"]
