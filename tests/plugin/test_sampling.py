"""Sampling: estimates are unbiased, and `sample`, `eval`, `pdf` and `eval_pdf` agree.

That the density is that of the samples is for test_chi2.
"""

from __future__ import annotations

import functools

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

import mitsuba_diffraction as md
from tests.support import gentle
from tests.support.directions import polar, rough_patch
from tests.support.lanes import interaction, lanes, spectra, vectors

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.filterwarnings("ignore::mitsuba_diffraction.errors.DiffractionWarning"),
]

#: nm; so far apart that dispersion sends each elsewhere.
WAVELENGTHS = [400.0, 480.0, 560.0, 700.0]
SURFACES = {
    "deep": {"field": rough_patch((64, 60), (0.085, 0.085), 0.8), "coherence_width": 5.0},
    "coherent": {
        "field": rough_patch((64, 60), (0.085, 0.085), 0.12),
        "coherence_width": 5.0,
        "coherence": "patch",
    },
    "grating": {
        "field": md.gratings.blazed(2.0, 0.15, periods=3, pixels_per_period=24),
        "coherence_width": 6.0,
        "height_scale": 1.2,
        "orientation": 25.0,
    },
    "pigmented": {
        "field": rough_patch((64, 60), (0.085, 0.085), 0.12),
        "coherence_width": 5.0,
        "int_ior": 1.5,
        "pigment": {"type": "diffuse", "reflectance": {"type": "uniform", "value": 0.4}},
    },
    "gold in the shade": {
        "field": rough_patch((64, 60), (0.085, 0.085), 0.3),
        "coherence_width": 5.0,
        "material": "Au",
        "shadowing": "vcavity",
        "energy_conserving": False,
    },
}
#: Not 0°: the pole of the grid over the hemisphere would fall on the narrowest lobes.
ANGLES = (5.0, 35.0, 70.0)


def load(name):
    """The plugin with that surface."""
    arguments = dict(SURFACES[name])
    field = arguments.pop("field")
    if not {"int_ior", "material"} & set(arguments):
        arguments["material"] = "none"
    return mi.load_dict(md.bsdf_dict(field, **arguments))


def drawn(bsdf, theta, numbers):
    """Samples for light from θ: directions (n, 3), densities (n,), weights (n, 4)."""
    u = np.minimum(numbers.astype(np.float32), np.float32(1 - 2**-24)).T
    u1, u2, u3 = map(lanes, u)
    si = interaction(np.tile(polar(theta, 40.0), (len(numbers), 1)), [WAVELENGTHS])
    sample, weight = bsdf.sample(mi.BSDFContext(), si, u1, mi.Point2f(u2, u3))
    dr.eval(sample, weight)  # one kernel instead of three
    return np.array(sample.wo, float).T, np.array(sample.pdf, float), spectra(weight)


@functools.cache
def hemisphere(rows: int) -> tuple[np.ndarray, np.ndarray]:
    """Midpoints (rows·2rows, 3) of a grid over (θ, φ), and the solid angles (rows, 1) of cells."""
    theta = (np.arange(rows) + 0.5) * np.pi / 2 / rows
    phi = (np.arange(2 * rows) + 0.5) * np.pi / rows
    edges = np.cos(np.arange(rows + 1) * np.pi / 2 / rows)
    x, y, z = (
        np.broadcast_to(a, (rows, 2 * rows))
        for a in (
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.sin(theta), np.sin(phi)),
            np.cos(theta)[:, None],
        )
    )
    directions = np.stack([x, y, z], axis=-1).reshape(-1, 3).astype(np.float32)
    return directions, (edges[:-1] - edges[1:])[:, None] * np.pi / rows


def on_grid(bsdf, theta, rows):
    """eval (rows, 2rows, 4) and pdf (rows, 2rows), both times the solid angles of the cells."""
    directions, cells = hemisphere(rows)
    si = interaction(np.tile(polar(theta, 40.0), (len(directions), 1)), [WAVELENGTHS])
    value, density = bsdf.eval_pdf(mi.BSDFContext(), si, vectors(directions))
    dr.eval(value, density)
    shape = (rows, 2 * rows)
    return (
        spectra(value).reshape(*shape, 4) * cells[..., None],
        np.array(density, float).reshape(shape) * cells,
    )


@pytest.mark.parametrize("name", SURFACES)
def test_sampling_estimates_equal_quadrature(variant, name):
    bsdf = load(name)
    log_n = 17
    # cells of 2 or 4 mrad, half of the narrowest lobe or less: no error to speak of
    rows = 384 if SURFACES[name].get("coherence_width") == 5.0 else 768
    even = stats.qmc.Sobol(3, rng=2).random_base2(log_n)
    for theta in ANGLES:
        value, density = on_grid(bsdf, theta, rows)

        # ∫ f cosθo dω at each wavelength, within three standard errors of independent samples
        albedo = value.sum(axis=(0, 1))
        _, pdf, weights = drawn(bsdf, theta, even)
        standard_error = weights.std(axis=0) / np.sqrt(len(weights))
        assert np.all(np.abs(weights.mean(axis=0) - albedo) < 3 * standard_error)

        # the density integrates to the share of samples above the surface
        # even samples are good to 2e-5; the density jumps between its cells, and halving the grid's
        # step moves the sum by up to 7e-4 (a grating near the pole)
        assert np.mean(pdf > 0) == pytest.approx(density.sum(), abs=1e-3)


@pytest.mark.parametrize("theta", [0.0, 50.0])
def test_weights_stay_small_where_lobes_are_far_narrower_than_their_distance(some_variant, theta):
    bsdf = gentle.load(rough_patch((60, 60), (0.13, 0.13), 0.1), coherence_width=400.0)
    n = 1 << 15
    rng = np.random.default_rng(4)
    si = interaction(np.tile(polar(theta), (n, 1)), [(450.0, 500.0, 550.0, 650.0)])
    s1, s2 = lanes(rng.random(n)), mi.Point2f(*map(lanes, rng.random((2, n))))
    weights = spectra(bsdf.sample(mi.BSDFContext(), si, s1, s2)[1])
    error = weights.std() / np.sqrt(n)
    assert weights.mean() == pytest.approx(1.0, abs=5 * error + 0.01)  # a gentle mirror
    assert weights.std() < 1.0
    assert weights.max() < 60.0  # with cells as wide as eleven lobes 400
