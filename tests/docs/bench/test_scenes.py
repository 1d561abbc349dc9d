"""The contender that draws by the cosine does so, and estimates the same."""

from __future__ import annotations

import pytest

import mitsuba_diffraction as md  # before Mitsuba: it chooses Dr.Jit's LLVM
from docs.make.bench.scenes import draws_by_cosine

import mitsuba as mi  # isort: skip
import drjit as dr  # isort: skip
import numpy as np  # isort: skip

pytestmark = pytest.mark.thorough


def drawn(bsdf, count=1 << 14):
    """Cosines of the directions drawn, their densities, and the weights at 550 nm."""
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(0.6, 0.0, 0.8)
    si.wavelengths = mi.Spectrum(550.0)
    random = mi.PCG32(size=count, initstate=3)
    numbers = [random.next_float32() for _ in range(3)]
    sample, weight = bsdf.sample(mi.BSDFContext(), si, numbers[0], mi.Point2f(*numbers[1:]))
    return np.array(sample.wo.z), np.array(sample.pdf), np.array(weight[0])


# how well the model holds is no matter
@pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")
def test_directions_are_drawn_by_the_cosine_and_the_albedo_is_the_same(some_variant):
    grating = md.gratings.sinusoidal(period=1.6, depth=0.08, periods=4)
    parameters = md.bsdf_dict(grating, coherence_width=8.0, material="none")
    ours = drawn(mi.load_dict(parameters))[2]
    cosines, density, weights = drawn(draws_by_cosine(mi.load_dict(parameters)))
    assert np.allclose(density, 0.97 * cosines / np.pi + 0.03 / (2 * np.pi), rtol=1e-4)
    assert weights.std() > 3 * ours.std()
    # four standard errors
    error = np.hypot(weights.std(), ours.std()) / np.sqrt(len(ours))
    assert abs(weights.mean() - ours.mean()) < 4 * error
