"""Meshes put on the stage: upright, standing on the floor, within what the camera sees."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.fitted_mesh import STAGE_HEIGHT, STAGE_RADIUS, UPS, fit_of

FILE = Path("table.obj")


def table(up: int) -> np.ndarray:
    """Vertices of a table top on four feet; the given axis points upwards."""
    top = [(x, y, z) for x in (-3.0, 3.0) for y in (-1.0, 1.0) for z in (1.5, 2.0)]
    feet = [(x, y, 0.0) for x in (-2.0, 2.0) for y in (-0.8, 0.8)]
    return np.roll(np.array(top + feet + [(3.5, 0.0, 3.0)]), up - 2, axis=1)


@given(
    st.sampled_from(UPS),
    st.floats(1e-4, 1e4),
    st.tuples(*[st.floats(-100, 100)] * 3),
)
def test_a_fitted_mesh_stands_centred_on_the_floor(up, scale, shift):
    positions = scale * (table(2) + shift)
    fit = fit_of(positions, FILE, up)
    placed = fit.scale * (positions @ fit.rotation.T) + fit.shift
    size = 1e-9 * np.abs(positions).max() * fit.scale + 1e-9  # rounding of the shift
    assert abs(placed[:, 2].min()) < size
    assert placed[:, 2].max() < STAGE_HEIGHT + size
    assert np.hypot(placed[:, 0], placed[:, 1]).max() < STAGE_RADIUS + size
    assert np.linalg.det(fit.rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("name", ["a.ply", "a.obj"])
@pytest.mark.parametrize(("axis", "up"), [(1, "y"), (2, "z")])
def test_what_has_feet_stands_on_them(axis, up, name):
    assert fit_of(table(axis), Path(name)).up == up


@pytest.mark.parametrize(
    ("positions", "said"),
    [
        (np.zeros((4, 3)), "flat"),
        (table(2) * [1.0, 1.0, 0.0], "flat"),
        (np.where(np.arange(3) == 1, np.nan, table(2)), "vertex 0 is not finite"),
    ],
)
def test_a_mesh_that_cannot_stand_is_refused(positions, said):
    with pytest.raises(DiffractionError, match=said):
        fit_of(positions, FILE)
    with pytest.raises(DiffractionError, match="choose one of"):
        fit_of(table(2), FILE, "up")
