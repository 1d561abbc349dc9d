"""`pdf` is the density of `sample`'s directions: the default; test_chi2_thorough.py has others."""

from __future__ import annotations

import math

import mitsuba as mi
import pytest

from tests.support.chi_square import DISPERSED, ROUGH, SMALL, Case, chi_square
from tests.support.directions import rough_patch
from tests.support.variants import runs

DEFAULT = {"int_ior": 1.5, "energy_conserving": True}
CASES = {
    "one wavelength, 45°": Case(ROUGH, 45.0, (400.0,), SMALL),
    "lobes far apart, order 1": Case(
        rough_patch((60, 60), (0.13, 0.13), 0.12),
        20.0,
        (550.0,),
        {"coherence_width": 60.0},
        (2.0 * math.pi / 7.8, 0.0),
    ),
    "dielectric, dispersed, 60°": Case(ROUGH, 60.0, DISPERSED, SMALL | DEFAULT),
}


@pytest.mark.parametrize("name", CASES)
def test_the_density_is_that_of_the_samples(some_variant, name):
    assert_density_of_samples(CASES[name])


def test_the_density_in_rgb_is_that_of_the_samples():
    if not runs("llvm_ad_rgb"):
        pytest.skip("llvm_ad_rgb: Dr.Jit finds no device for it")
    mi.set_variant("llvm_ad_rgb")
    assert_density_of_samples(Case(ROUGH, 50.0, (550.0,), SMALL))


def assert_density_of_samples(case):
    test = chi_square(case.load(), case, samples=1 << 20)
    # 1 % for all cases together; the numbers drawn are always the same
    assert test.run(0.01, len(CASES), quiet=True), test.messages


def test_a_wrong_density_is_rejected(some_variant):
    case = CASES["one wavelength, 45°"]
    test = chi_square(case.load(), case, pdf_at=(404.0,))  # 1 % beside the samples' wavelength
    assert not test.run(0.01, len(CASES), quiet=True)
