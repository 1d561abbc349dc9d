"""The baselines of `bench` compute what they claim to, so that comparing times is fair."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from docs.make.bench.contenders import (
    DEFAULT,
    TAYLOR,
    THESIS,
    bare_gathers,
    bsdf_factories,
    build_tables,
)
from docs.make.bench.figures import Plan
from docs.make.bench.scenes import draws_by_cosine
from mitsuba_diffraction.analysis.timing import Queries
from mitsuba_diffraction.optics.geometry import wavenumber
from mitsuba_diffraction.tables.window import base_bin, first_tap

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module")
def factories(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tables")
    tables = build_tables(Plan(pixels=160), folder, lambda done, total, text: None)
    return bsdf_factories(tables)


@pytest.fixture
def queries(variant):
    return Queries.random(500)


def test_an_image_a_term_is_the_same_series(factories, queries):
    values = [
        np.array(factories[name]().eval(mi.BSDFContext(), queries.si, queries.wo))
        for name in (THESIS, TAYLOR)
    ]
    # 37 terms in another order, in single precision
    assert np.abs(values[0] - values[1]).sum() < 1e-5 * values[1].sum()


def test_bare_gathers_read_what_a_look_up_reads(factories, queries):
    bsdf = factories[DEFAULT]()
    table = bsdf.table
    total = np.array(queries.si.wi + queries.wo, np.float32).astype(float)
    expected = np.zeros(total.shape[1], np.int32)
    for wavelength in np.array(queries.si.wavelengths, float):
        k = wavenumber(wavelength)
        interval = table.expansion.interval(k * total[2])
        first = [
            base_bin(k * total[axis] / table.spacing[axis], taps) + first_tap(taps)
            for axis, taps in enumerate(table.grid.taps)
        ]
        column, row = (f.astype(int) + n for f, n in zip(first, table.grid.last, strict=True))
        for j, columns in enumerate(table.grid.tapped()):
            for i in columns:
                halves = table.coefficients[interval, row + j, column + i]
                bits = halves.reshape(len(halves), 2, -1).view(np.uint16).astype(np.uint32)
                words = bits[:, 0] | (bits[:, 1] << 16)
                expected += words.sum(axis=1, dtype=np.uint32).view(np.int32)
    gathered = np.array(bare_gathers(bsdf, queries)())
    # in single precision a few of the 4 × 500 look-ups fall into the neighbouring bin
    assert (gathered != expected).mean() < 0.01


def test_the_measured_surface_reflects_what_its_file_says(factories, queries):
    values = np.array(factories["measured"]().eval(mi.BSDFContext(), queries.si, queries.wo))
    np.testing.assert_allclose(values, 1.0, rtol=1e-6)  # single precision


def test_queries_do_not_change(queries):
    again = Queries.random(500)
    assert dr.all(again.wo == queries.wo, axis=None)
    assert dr.all((queries.si.wi.z > 0) & (queries.wo.z > 0))


def drawn(bsdf, count=1 << 14):
    """Cosines of the directions drawn, their densities, and the weights at 550 nm."""
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(0.6, 0.0, 0.8)
    si.wavelengths = mi.Spectrum(550.0)
    random = mi.PCG32(size=count, initstate=3)
    numbers = [random.next_float32() for _ in range(3)]
    sample, weight = bsdf.sample(mi.BSDFContext(), si, numbers[0], mi.Point2f(*numbers[1:]))
    return np.array(sample.wo.z), np.array(sample.pdf), np.array(weight[0])


# the accuracy of the model does not matter
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
