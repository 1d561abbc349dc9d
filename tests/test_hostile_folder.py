"""A folder from somebody else: nothing there runs, and no other file is read."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from mitsuba_diffraction.plugin import installed
from tests.support.hostile import other_metals, plugins_in

pytestmark = pytest.mark.thorough

_PROGRAM = """
import mitsuba_diffraction as md
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
print(mi.load_dict({"type": "uniform", "value": 0.5}))
for name in md.plugin.installed.REGISTERED:
    try:
        mi.load_dict({"type": name})
    except RuntimeError as error:
        assert "not found" not in str(error), error
print(mi.file_resolver().resolve("data/ior/Al.eta.spd"))
"""


def test_nothing_in_the_current_folder_runs_in_a_program(tmp_path, monkeypatch):
    """Mitsuba sets its search path once, when it is imported."""
    folder = tmp_path / "a"
    folder.mkdir()
    monkeypatch.chdir(folder)
    mark = plugins_in(folder, tmp_path / "ran", ["unheard_of", "uniform", *installed.REGISTERED])
    other_metals(folder)
    ran = subprocess.run([sys.executable, "-c", _PROGRAM], capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
    assert Path(ran.stdout.splitlines()[-1]).is_relative_to(installed.folder())
    assert not mark.exists()
