"""Imports in processes of their own: what loads Mitsuba, and when it has the plugins."""

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
PACKAGE, MITSUBA = "import mitsuba_diffraction as md", "import mitsuba as mi"
VARIANT = "mi.set_variant('scalar_rgb')"
LOADED = """
field = md.gratings.sinusoidal(2.0, 0.1, periods=2)
print(type(mi.load_dict(md.bsdf_dict(field, coherence_width=4.0))).__name__)
"""


def printed(code: str) -> str:
    """Return what a Python process prints."""
    ran = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], cwd=ROOT, capture_output=True, text=True
    )
    assert ran.returncode == 0, ran.stderr
    return ran.stdout.strip()


def test_numpy_rooms_load_no_mitsuba():
    assert printed(WITHOUT.format(rooms=ROOMS)) == "set()"


@pytest.mark.parametrize(
    "lines",
    [
        (PACKAGE, MITSUBA, VARIANT),
        (MITSUBA, PACKAGE, VARIANT),
        (MITSUBA, VARIANT, PACKAGE),
        ("from mitsuba_diffraction import bsdf_dict", MITSUBA, VARIANT, PACKAGE),
    ],
)
def test_mitsuba_has_the_plugins_in_whatever_order_it_is_imported(lines):
    assert printed("\n".join(lines) + LOADED) == "Diffraction"
