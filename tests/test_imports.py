"""Rooms that are NumPy alone, in a process of their own."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support import ROOT

pytestmark = pytest.mark.thorough

ROOMS = ("heights", "optics", "tables", "reference")
WITHOUT = """
import importlib, pkgutil, sys
for name in {rooms}:
    room = importlib.import_module(f"mitsuba_diffraction.{{name}}")
    for module in pkgutil.walk_packages(room.__path__, f"{{room.__name__}}."):
        importlib.import_module(module.name)
print({{"mitsuba", "drjit"}} & set(sys.modules))
"""


def test_numpy_rooms_load_no_mitsuba():
    code = WITHOUT.format(rooms=ROOMS)
    ran = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], cwd=ROOT, capture_output=True, text=True
    )
    assert (ran.returncode, ran.stdout.strip()) == (0, "set()"), ran.stderr
