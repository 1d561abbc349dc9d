"""Directions that are no numbers, as degenerate triangles make them: NaN, never a wild read."""

from __future__ import annotations

import subprocess
import sys

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support import ROOT

pytestmark = pytest.mark.thorough

# In a child: a read outside the table may end the process, where memory happens to end.
PROGRAM = """
import numpy as np, drjit as dr, warnings
warnings.simplefilter("ignore")
import mitsuba_diffraction as md, mitsuba as mi
from tests.support.coarse import coarse_energy
from tests.support.kernels import compile_quickly
coarse_energy()
compile_quickly()
mi.set_variant("llvm_ad_spectral")
heights = np.random.default_rng(0).uniform(0.0, 0.2, (300, 300))
field = md.HeightField(heights, 0.08)
bsdf = mi.load_dict(md.bsdf_dict(field, material="none", coherence_width=24.0))
right = dr.opaque(mi.Float, 0.5, 1000)
si = dr.zeros(mi.SurfaceInteraction3f, 1000)
si.wavelengths = mi.Spectrum(550.0)
for number in ("nan", "1e30"):
    for wrong in range(6):
        # arrays of their own, so that one kernel serves all
        parts = [dr.opaque(mi.Float, 0.5**0.5 if n % 3 == 2 else 0.5, 1000) for n in range(6)]
        parts[wrong] = dr.opaque(mi.Float, float(number), 1000)
        si.wi = mi.Vector3f(*parts[:3])
        value, density = bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(*parts[3:]))
        drawn, weight = bsdf.sample(mi.BSDFContext(), si, right, mi.Point2f(right, right))
        dr.eval(value, density, drawn, weight)
    dr.sync_thread()
    print(number, "is survived")
"""


@pytest.mark.usefixtures("variant")
def test_an_index_is_always_in_its_range():
    from mitsuba_diffraction.plugin.memory import index_between

    values = mi.Float([np.nan, np.inf, -np.inf, 2.0, -1.0, 1e30])
    dr.make_opaque(values)
    np.testing.assert_array_equal(index_between(values, 0.0, 3.0), [0, 3, 0, 2, 0, 3])


def test_directions_that_are_no_numbers_do_not_end_the_process():
    ran = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=ROOT, capture_output=True, text=True, timeout=120
    )
    said = ["nan is survived", "1e30 is survived"]
    assert (ran.returncode, ran.stdout.splitlines()) == (0, said), ran.stderr
