"""The plugin in every variant, whenever it is imported."""

from __future__ import annotations

import os
import subprocess
import sys

import mitsuba as mi
import numpy as np
import pytest

from tests.support import ROOT
from tests.support.gentle import load, pairs
from tests.support.lanes import evaluated


def test_variants_may_be_switched_back_and_forth(some_variant):
    wi, wo, lam = pairs(20)
    first = load()
    before = evaluated(first, wi, wo, lam[:, None])
    for name in ("scalar_rgb", "llvm_ad_rgb", some_variant):
        mi.set_variant(name)
    assert np.array_equal(evaluated(load(), wi, wo, lam[:, None]), before)
    assert np.array_equal(evaluated(first, wi, wo, lam[:, None]), before)  # still of use


# Mitsuba 3.10 imports the modules of entry points, and reloads them at each change of variant
DISCOVERY = """
import importlib, sys, tomllib, mitsuba as mi
entries = tomllib.load(open('pyproject.toml', 'rb'))['project']['entry-points']['mitsuba']
for name in ('scalar_rgb', '{0}', 'llvm_ad_rgb', '{0}'):
    mi.set_variant(name)
    for module in entries.values():
        if module in sys.modules:
            importlib.reload(sys.modules[module])
        else:
            importlib.import_module(module)
md = sys.modules['mitsuba_diffraction']
"""

LOADS = """
import numpy as np
heights = 0.01 * np.sin(np.arange(64) / 64 * 2 * np.pi)[None, :] + np.zeros((64, 1))
def check():
    own = {'coherence_width': 5.0, 'energy_conserving': False}
    b = mi.load_dict(md.bsdf_dict(md.HeightField(heights, 0.08), **own))
    assert 'Diffraction[' in str(b), b
"""


@pytest.mark.parametrize(
    "order",
    [
        pytest.param(
            "import mitsuba as mi; mi.set_variant('{0}'); import mitsuba_diffraction as md",
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            "from mitsuba_diffraction import bsdf_dict; import mitsuba as mi; "
            "mi.set_variant('{0}'); import mitsuba_diffraction as md",
            marks=pytest.mark.thorough,
        ),
        "import mitsuba as mi; import mitsuba_diffraction as md; mi.set_variant('scalar_rgb'); "
        "mi.set_variant('{0}'); mi.set_variant('llvm_ad_rgb'); mi.set_variant('{0}')",
        pytest.param(DISCOVERY, marks=pytest.mark.thorough),
    ],
    ids=["variant first", "one name first", "several variants", "discovered by Mitsuba"],
)
def test_the_plugin_is_there_whenever_it_is_imported(some_variant, order):
    code = f"{order.format(some_variant)}\n{LOADS}\ncheck()"
    result = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:mitsuba_diffraction", "-c", code],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert (result.returncode, result.stderr) == (0, "")
