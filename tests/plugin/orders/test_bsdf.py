"""The BSDF `diffraction_orders`: its light is that of the table, however it is asked."""

from __future__ import annotations

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from mitsuba_diffraction import DiffractionError, OrderTable, reference
from tests.support.chi_square import DISPERSED, Case, chi_square
from tests.support.directions import as_single, uniform_directions
from tests.support.orders import thin_grating
from tests.support.variants import evaluate, interaction

PERIOD, N = 1.6, 60
TABLES = {"bare": thin_grating(PERIOD), "under a coat": thin_grating(PERIOD, superstrate=1.5)}
#: Share of the light, mean over orders: linear interpolation between the corners of cells; under a
#: coat those hold the sum of reflections, with a kink at the critical angle of each order.
TOLERANCE = {"bare": 1e-3, "under a coat": 0.015}


def load(table, **parameters):
    return mi.load_dict(md.bsdf_dict(table, **parameters))


def pairs(n=N, seed=5):
    """Directions in the lobes of orders of the first wavelength, wavelengths, random numbers."""
    rng = np.random.default_rng(seed)
    wi = uniform_directions(n, rng, 0.15)
    wavelength = as_single(rng.uniform(400.0, 700.0, (n, 4)))
    wo = np.empty((n, 3))
    for row in range(n):
        squared = 2.0
        while squared > 0.98:
            shift = [rng.integers(-4, 5) * wavelength[row, 0] / (1e3 * PERIOD), 0.0]
            tangential = shift - wi[row, :2] + rng.normal(0.0, 0.003, 2)
            squared = (tangential**2).sum()
        wo[row] = [*tangential, np.sqrt(1.0 - squared)]
    return wi, as_single(wo), rng.random((n, 3)), wavelength


@pytest.mark.parametrize("name", TABLES)
def test_values_are_the_references(some_variant, name):
    table = TABLES[name]
    wi, wo, samples, wavelength = pairs()
    values, pdf, again, pdf_again, *_ = evaluate(load(table), wi, wo, samples, wavelength)
    expected = reference.orders_brdf(
        table.efficiency, PERIOD, wi, wo, wavelength[:, 0], superstrate=table.superstrate
    )
    expected = expected * wo[:, 2]
    assert np.abs(values[:, 0] - expected).sum() <= TOLERANCE[name] * expected.sum()
    assert np.array_equal(values, again)
    assert np.array_equal(pdf, pdf_again)


def test_a_mirror_is_that_of_the_plugin_diffraction(some_variant):
    rng = np.random.default_rng(1)
    wi = uniform_directions(N, rng, 0.3)
    wo = -wi + np.column_stack([rng.normal(0.0, 0.004, (N, 2)), np.zeros(N)])
    wo[:, 2] = np.sqrt(1.0 - (wo[:, :2] ** 2).sum(axis=1))
    light = wi, wo, rng.random((N, 3)), as_single(rng.uniform(400.0, 700.0, (N, 4)))
    flat = md.HeightField(np.zeros((8, 8)), 0.2, periodic=True)
    mirror = load(flat, material="none", energy_conserving=False)
    orders = evaluate(load(OrderTable.mirror(PERIOD)), *light)[0]
    # beside the centre of its lobe Kirchhoff's mirror has (1 + ωi·ωo)²/(w² cosθi cosθo)
    assert orders == pytest.approx(evaluate(mirror, *light)[0], rel=5e-3)


@pytest.mark.parametrize("name", TABLES)
def test_weights_are_the_albedo(some_variant, name):
    table = TABLES[name]
    bsdf = load(table)
    for theta in (0.0, 45.0, 75.0):
        si = interaction(
            np.tile([np.sin(np.radians(theta)), 0.0, np.cos(np.radians(theta))], (4096, 1)),
            np.full((4096, 4), 550.0),
        )
        random = mi.PCG32(size=4096)
        numbers = [random.next_float32() for _ in range(3)]
        _, weight = bsdf.sample(mi.BSDFContext(), si, numbers[0], mi.Point2f(*numbers[1:]))
        weights = np.array(weight[0])
        # the lobes are sampled exactly; parts of one may lie beyond the horizon, and under a coat
        # the chances have the face's transmittance interpolated
        assert weights.std() <= (0.2 if theta == 75.0 else 0.1) * weights.mean()


@pytest.mark.parametrize("case", [Case(None, 0.0, DISPERSED), Case(None, 60.0, DISPERSED)])
def test_the_density_is_that_of_the_samples(some_variant, case):
    # a window of three periods: lobes that overlap, and wide enough for the histogram
    bsdf = load(TABLES["bare"], coherence_width=3.0 * PERIOD)
    test = chi_square(bsdf, case, samples=1 << 19)
    # 1 % for both cases together; the numbers drawn are always the same
    assert test.run(0.01, 2, quiet=True), test.messages


def test_derivatives_follow_the_orientation(some_variant):
    wi, wo, _, wavelength = pairs(16)
    bsdf = load(TABLES["bare"], orientation=1.0, coherence_width=20.0)
    parameters = mi.traverse(bsdf)
    si = interaction(wi, wavelength)

    def light():
        return dr.sum(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T))[0])

    dr.enable_grad(parameters["orientation"])
    parameters.update()
    total = light()
    dr.backward(total)
    derivative = float(parameters["orientation"].grad[0])
    step = 0.02
    ends = []
    for degrees in (1.0 - step, 1.0 + step):
        parameters["orientation"] = mi.Float(degrees)
        parameters.update()
        ends.append(float(light()[0]))
    # central differences in single precision
    assert derivative == pytest.approx((ends[1] - ends[0]) / (2.0 * step), rel=2e-2)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"coherence_width": 2.0}, "periods"),
        ({"orientations": 1.0}, "orientation"),
        ({"coat_ior": 1.5}, "unknown"),
    ],
)
def test_unfit_parameters_are_refused_in_one_line(some_variant, parameters, message):
    with pytest.raises(Exception, match=message) as caught:
        load(TABLES["bare"], **parameters)
    assert isinstance(caught.value.__cause__ or caught.value, (DiffractionError, RuntimeError))


def test_files_are_loaded_by_name(some_variant, tmp_path):
    path = tmp_path / "grating.nc"
    thin_grating(0.6, counts=(2, 2, 1)).save(path)
    bsdf = mi.load_dict({"type": "diffraction_orders", "table": str(path)})
    assert "0.6 µm" in str(bsdf)
    with pytest.raises(Exception, match="does not exist"):
        mi.load_dict({"type": "diffraction_orders", "table": str(tmp_path / "none.nc")})
