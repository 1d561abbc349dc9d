"""`lateral_scale`: values of stretched heights, samples, derivatives, and what is refused."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest

import mitsuba_diffraction as md
from docs.make.bench.kernels import kernel_operations
from mitsuba_diffraction import DiffractionError
from tests.support.furnace import furnace, sinusoid
from tests.support.gentle import PATCH, WIDTH, bitmap, load, pairs
from tests.support.lanes import evaluated, interaction, refusal, vectors

pytestmark = pytest.mark.thorough


def stretched(factor, largest=None):
    """Heights stretched by a factor, and the width of their window."""
    return PATCH.stretched(factor), WIDTH * factor / max(1.0, largest or factor)


def test_steep_light_within_is_that_of_stretched_heights(mono):
    """Sums of directions reach further than tables do, whatever the factor."""
    factor, rng = 0.65, np.random.default_rng(5)
    patch = md.HeightField(0.1 * rng.random((12, 12)), 0.1, periodic=True)
    parameters = {"plugin": "diffraction_dielectric", "int_ior": 2.5, "ext_ior": 1.0}
    parameters |= {"energy_conserving": False, "model": "kirchhoff"}
    given, made = (
        mi.load_dict(md.bsdf_dict(heights, **parameters, **more))
        for heights, more in (
            (patch, {"lateral_scale": factor, "coherence_width": 1.2}),
            (patch.stretched(factor), {"coherence_width": 1.2 * factor}),
        )
    )
    wi, wo = rng.standard_normal((2, 500, 3)) * (1.0, 1.0, 0.5)
    wi, wo = (w / np.linalg.norm(w, axis=1, keepdims=True) for w in (wi, wo))
    wi[:, 2] = -np.abs(wi[:, 2])
    sums = 2.5 * np.linalg.norm((wi + wo)[wo[:, 2] < 0.0][:, :2], axis=1)
    assert np.sum((sums > 2.0) & (sums < 2.0 / factor)) > 20
    values = [evaluated(bsdf, wi, wo, 550.0) for bsdf in (given, made)]
    # both tables have a relative error of 1e-3 of the mean power
    np.testing.assert_allclose(*values, rtol=0.02, atol=2e-3 * values[1].max())


def test_energy_is_conserved_at_each_factor_as_by_stretched_heights(mono):
    """A deep mirror grating, whose albedo is 1.43 by the scales of the unstretched patch."""
    factors = np.array([[0.8, 1.0]], np.float32)
    heights = sinusoid()
    surfaces = [
        mi.load_dict(md.bsdf_dict(field, material="none", coherence_width=width, **parameters))
        for field, width, parameters in (
            (heights, 65.0, {"lateral_scale": 0.8}),
            (heights, 65.0, {"lateral_scale": bitmap(factors)}),
            (heights.stretched(0.8), 52.0, {}),
        )
    ]
    # the texture's uv is (0, 0), where the factor is 0.8
    constant, varying, expected = (
        furnace(surface, (20.0, 50.0, 75.0, 84.0))[0] for surface in surfaces
    )
    for albedo in (constant, varying):
        assert albedo.max() < 1.03
        # both scales are linear between wavelengths, of other nodes, on a coarse grid: 0.021; with
        # the scale of the unstretched patch it is 0.12
        assert np.abs(albedo - expected).mean() < 0.03


def test_without_it_kernels_have_no_operation_for_it(mono):
    wi, wo, _ = pairs(8)
    si = interaction(wi, 550.0)

    def operations(**parameters):
        bsdf = load(**parameters)
        return kernel_operations(lambda: bsdf.eval_pdf(mi.BSDFContext(), si, vectors(wo)))

    # three multiplications and a scalar that is read, not a second evaluation
    assert 0 < operations(lateral_scale=1.0) - operations() < 12


def test_numbers_change_up_to_the_largest_loaded(mono):
    wi, wo, _ = pairs(20)
    bsdf = load(lateral_scale=1.3)
    parameters = mi.traverse(bsdf)
    parameters["lateral_scale"] = 0.8
    parameters.update()
    heights, width = stretched(0.8, 1.3)
    expected = evaluated(load(heights, coherence_width=width), wi, wo, 550.0)
    values = evaluated(bsdf, wi, wo, 550.0)
    # two tables, of the same tolerance
    assert values == pytest.approx(expected, rel=0.05, abs=2e-3 * float(expected.max()))
    parameters["lateral_scale"] = 1.4
    with pytest.raises(DiffractionError, match=r"at most 1\.3, the table.s range"):
        parameters.update()


def test_tables_serve_no_larger_factors_than_1(mono, tmp_path):
    path = tmp_path / "patch.exr"
    md.DiffractionTable.build(PATCH, coherence_width=WIDTH).save(path)
    raw = {"material": "none", "energy_conserving": False}
    plugin = {"type": "diffraction", "filename": str(path), **raw}
    mi.load_dict(plugin | {"lateral_scale": 0.9})
    said = refusal(lambda: mi.load_dict(plugin | {"lateral_scale": 1.1}))
    assert "give the height field instead of the table" in said


@pytest.mark.parametrize("factor", [1.1, 1.2, 1.6, 1.7, 2.2])
def test_numbers_above_1_load(mono, factor):
    """Their double is below their single precision, or above it."""
    assert mi.traverse(load(lateral_scale=factor))["lateral_scale"] == mi.Float(factor)


def test_a_number_goes_up_to_its_largest_factor_and_has_the_values_of_one_loaded_there(mono):
    wide = load(lateral_scale=0.9, lateral_scale_max=1.4)
    parameters = mi.traverse(wide)
    parameters["lateral_scale"] = mi.Float(1.4)
    parameters.update()
    loaded = load(lateral_scale=1.4)
    wi, wo, _ = pairs()
    values = [evaluated(bsdf, wi, wo, 550.0) for bsdf in (wide, loaded)]
    assert np.array_equal(*values)
    parameters["lateral_scale"] = mi.Float(1.41)
    with pytest.raises(DiffractionError, match="lateral_scale_max"):
        parameters.update()
