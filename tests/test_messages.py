"""Messages keep what they say, but for what is long in itself; warnings name the user's line.

A package that is not installed is one line that names the extra which has it. Streams are the
program's: only our own command line keeps a library's words from them.
"""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
import tomllib
import unicodedata
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import mitsuba_diffraction
from mitsuba_diffraction import DiffractionTable
from mitsuba_diffraction.errors import (
    DiffractionError,
    DiffractionWarning,
    printable,
    warn,
)
from mitsuba_diffraction.extras import optional
from mitsuba_diffraction.streams import own_program, without_chatter
from tests.support import ROOT
from tests.support.directions import rough_patch

PACKAGE = Path(mitsuba_diffraction.__file__).parent


def test_a_long_quotation_is_cut_in_its_middle():
    text = str(DiffractionError(f"name='{'a b ' * 100}' is too long"))
    assert len(text) < 200
    assert text.endswith("is too long")


SCRIPT = """
import numpy as np
import mitsuba as mi
import mitsuba_diffraction as md
mi.set_variant("scalar_rgb")
patch = md.HeightField(0.2 * np.random.default_rng(0).random((32, 32)), 0.08, name="steep")
for _ in range(3):
    mi.load_dict(md.bsdf_dict(patch, coherence_width=2.0, energy_conserving=False))
np.array([1e308]) * 10
"""


def test_a_script_is_warned_once_at_its_own_line(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT)
    ran = subprocess.run(
        [sys.executable, "script.py"], cwd=tmp_path, capture_output=True, text=True, check=True,
        env={**os.environ, "PYTHONPATH": str(ROOT), "MITSUBA_DIFFRACTION_CACHE": str(tmp_path)},
    )  # fmt: skip
    ours = [line for line in ran.stderr.splitlines() if "steep: " in line and "RMS slope" in line]
    assert len(ours) == 1
    assert ours[0].startswith(f"{tmp_path / 'script.py'}:8: DiffractionWarning: ")
    assert str(ROOT) not in ran.stderr.replace(str(tmp_path), "")
    assert "script.py:9: RuntimeWarning: overflow" in ran.stderr  # another package's, as ever


def test_a_warning_is_one_line_of_its_own_kind():
    with pytest.warns(DiffractionWarning, match="^steep slopes$") as caught:
        warn("steep\n  slopes")
    assert caught[0].filename == __file__


@given(st.text())
def test_no_text_controls_the_terminal(text):
    """Neither ESC, OSC and BEL nor bidirectional overrides; JSON keeps its meaning."""
    shown = printable(text)
    kinds = {unicodedata.category(c) for c in shown if c not in "\n\t"}
    assert not {"Cc", "Cf", "Cs", "Co", "Cn", "Zl", "Zp"} & kinds
    assert printable(shown) == shown
    assert json.loads(printable(json.dumps(text, ensure_ascii=False))) == text
    error = str(DiffractionError(text))
    assert error == printable(error)


def test_commands_that_messages_name_exist():
    from mitsuba_diffraction.cli import build_parser

    (commands,) = (a.choices for a in build_parser()._actions if isinstance(a.choices, dict))
    # adjacent strings are one
    texts = [re.sub(r'"\n\s*f?"', "", f.read_text("utf-8")) for f in PACKAGE.rglob("*.py")]
    named = {name for text in texts for name in re.findall(r"the command '([\w-]+)", text)}
    assert "precompute" in named
    assert named <= set(commands)


@pytest.fixture
def damaged(tmp_path):
    """A table whose pixels cannot be decompressed, of which OpenEXR says so in two streams."""
    file = tmp_path / "table.exr"
    DiffractionTable.build(rough_patch((20, 24), (0.08, 0.09), 0.15), coherence_width=1.8).save(
        file
    )
    file.write_bytes(file.read_bytes()[:-100] + bytes(100))
    return file


def load(file):
    with pytest.raises(DiffractionError):
        DiffractionTable.load(file)


def test_a_library_s_streams_are_left_alone(damaged, capfd):
    before = os.fstat(1), os.fstat(2)
    load(damaged)
    assert all("EXR_ERR" in line for line in capfd.readouterr().err.splitlines())
    with without_chatter():
        assert os.path.samestat(before[1], os.fstat(2))
        print("heard")
    assert capfd.readouterr().out == "heard\n"


def test_a_program_of_ours_says_its_own_line_only_and_keeps_its_streams(damaged, capfd):
    before = os.fstat(1), os.fstat(2)
    with own_program():
        threads = [threading.Thread(target=load, args=[damaged], daemon=True) for _ in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join(60)
    assert capfd.readouterr() == ("", "")
    assert all(os.path.samestat(a, os.fstat(n)) for n, a in enumerate(before, start=1))
    print("after")
    os.write(2, b"as well")
    assert capfd.readouterr() == ("after\n", "as well")


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
