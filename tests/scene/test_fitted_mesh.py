"""Meshes put on the stage: upright, standing on the floor, within what the camera sees."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.fitted_mesh import (
    STAGE_HEIGHT,
    STAGE_RADIUS,
    UPS,
    fit_of,
    framing,
    turned_around,
)

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


@example([(0.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -2.5, 0.0), (1.0, 0.0, 0.0)], 1.0, 0.0, 1.0, 1.0)
@given(
    st.lists(st.tuples(*[st.floats(-3, 3)] * 3), min_size=4, max_size=20),
    st.floats(-3, 3), st.floats(-1.2, 1.2), st.floats(0.1, 1.0), st.floats(0.1, 1.0),
)  # fmt: skip
def test_a_framed_mesh_touches_the_picture_s_margin_on_two_opposite_sides(points, az, el, tx, ty):
    positions = np.array(points)
    if np.linalg.matrix_rank(positions - positions[0], tol=1e-3) < 3:
        return
    forwards = np.array([np.cos(el) * np.cos(az), np.cos(el) * np.sin(az), np.sin(el)])
    right = np.array([-np.sin(az), np.cos(az), 0.0])
    camera = np.stack([right, np.cross(forwards, right), forwards], axis=-1)
    local = (positions - framing(positions, camera, (tx, ty))) @ camera
    nearest = local[:, 2].min() / np.ptp(local, axis=0).max()
    assert nearest > 0.1 - 1e-9  # where the camera would stand in the mesh's tip
    seen = local[:, :2] / local[:, 2:] / (tx, ty)
    low, high = seen.min(axis=0), seen.max(axis=0)
    if nearest > 0.1 + 1e-9:
        assert high.max() == pytest.approx(-low[np.argmax(high)])
        assert high.max() == pytest.approx(-low.min())
        assert 0.8 < high.max()
    assert high.max() < 0.9


def test_a_mesh_that_turns_stays_within_its_sweep():
    positions = np.random.default_rng(0).normal(size=(200, 3))
    swept = turned_around(positions)
    radius = np.hypot(swept[:, 0], swept[:, 1])
    for x, y, z in positions:
        near = np.abs(swept[:, 2] - z) <= np.ptp(positions[:, 2]) / 63
        assert radius[near].max() >= np.hypot(x, y)
    assert radius.max() == pytest.approx(np.hypot(positions[:, 0], positions[:, 1]).max())
