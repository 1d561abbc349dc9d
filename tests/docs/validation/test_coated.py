"""Gratings under a coat: the series of bounces, and the model beside rigorous solutions."""

from __future__ import annotations

import numpy as np
import pytest

from docs.make.validation import coated
from docs.make.validation.cases import COAT, order_sines
from docs.make.validation.solutions import stored
from mitsuba_diffraction.reference.fresnel import amplitudes


def made(matrix: np.ndarray, series: str) -> np.ndarray:
    """What leaves of orders of 1.6 µm at 30° and 610 nm, TE."""
    orders, sines = order_sines(1.6, 610.0, 30.0)
    inside = coated.inner_orders(1.6, 610.0, 30.0)
    face = np.abs(amplitudes(np.sqrt(1 - sines**2), COAT)[0]) ** 2
    return coated.leaving(matrix, face, np.isin(inside, orders), orders, series=series)


def test_of_a_structure_that_loses_nothing_all_light_leaves():
    count = len(coated.inner_orders(1.6, 610.0, 30.0))
    matrix = np.full((count, count), 1.0 / count)  # whatever comes down is spread evenly
    assert made(matrix, "bounced").sum() == pytest.approx(1.0, abs=1e-12)
    assert made(matrix, "single").sum() < 0.8


def test_of_a_mirror_it_is_that_of_two_mirrors():
    orders = order_sines(1.6, 610.0, 30.0)[0]
    matrix = 0.9 * np.eye(len(coated.inner_orders(1.6, 610.0, 30.0)))
    face = np.abs(amplitudes(np.cos(np.radians(30.0)), COAT)[0]) ** 2
    out = made(matrix, "bounced")
    assert out[orders != 0] == pytest.approx(0.0)
    assert out[orders == 0] == pytest.approx(face + (1 - face) ** 2 * 0.9 / (1 - 0.9 * face))


@pytest.mark.parametrize("grating", coated.GRATINGS[:4], ids=str)
def test_gentle_gratings_under_a_coat(grating):
    for deviation in coated.deviations([grating]):
        # refraction and transmission; half a per cent is the structure's own deviation
        assert deviation.single < 0.005, deviation
        # the model's bounces leave less than no bounces would
        assert deviation.bounced < 0.85 * deviation.share, deviation
        assert deviation.bounced < 0.1, deviation


def test_an_order_inside_is_solved_as_it_is_kept():
    grating = coated.GRATINGS[2]
    rows = coated.solve_one(grating, 30.0, 610.0)
    for series in coated.SERIES:
        kept = stored(coated.FILE.format(series)).where(
            grating=grating, theta=30.0, wavelength=610.0
        )
        assert rows[series]["te"] == pytest.approx(kept.rows["te"], abs=1e-6)
        assert rows[series]["tm"] == pytest.approx(kept.rows["tm"], abs=1e-6)
