"""Meshes put on the stage: upright, standing on the floor, within what the camera sees."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from mitsuba_diffraction.scene.elements import has_texcoords
from mitsuba_diffraction.scene.fitted_mesh import (
    STAGE_HEIGHT,
    STAGE_RADIUS,
    UPS,
    fit_of,
    framing,
    turned_around,
)
from mitsuba_diffraction.scene.orientation.mesh_files import mesh_arrays
from mitsuba_diffraction.scene.orientation.trimesh import TriangleMesh

FILE = Path("table.obj")


def table(up: int) -> np.ndarray:
    """Vertices of a table top on four feet; the given axis points upwards."""
    top = [(x, y, z) for x in (-3.0, 3.0) for y in (-1.0, 1.0) for z in (1.5, 2.0)]
    feet = [(x, y, 0.0) for x in (-2.0, 2.0) for y in (-0.8, 0.8)]
    return np.roll(np.array(top + feet + [(3.5, 0.0, 3.0)]), up - 2, axis=1)


def mesh(positions: np.ndarray, normal=(0.0, 0.0, 1.0)) -> TriangleMesh:
    """A mesh of these vertices."""
    normals = np.tile(normal, (len(positions), 1))
    return TriangleMesh(positions, normals, None, np.array([[0, 1, 2]]))


@given(
    st.sampled_from(UPS),
    st.floats(1e-4, 1e4),
    st.tuples(*[st.floats(-100, 100)] * 3),
)
def test_a_fitted_mesh_stands_centred_on_the_floor(up, scale, shift):
    positions = scale * (table(2) + shift)
    fit = fit_of(mesh(positions), FILE, up)
    placed = fit.scale * (positions @ fit.rotation.T) + fit.shift
    size = 1e-9 * np.abs(positions).max() * fit.scale + 1e-9  # rounding of the shift
    assert abs(placed[:, 2].min()) < size
    assert placed[:, 2].max() < STAGE_HEIGHT + size
    assert np.hypot(placed[:, 0], placed[:, 1]).max() < STAGE_RADIUS + size
    assert np.linalg.det(fit.rotation) == pytest.approx(1.0)
    axis = np.eye(3)["xyz".index(fit.up[-1])] * (-1.0 if fit.up[0] == "-" else 1.0)
    np.testing.assert_array_equal(fit.rotation @ axis, [0.0, 0.0, 1.0])


@pytest.mark.parametrize("name", ["a.ply", "a.obj"])
@pytest.mark.parametrize(("axis", "up"), [(1, "y"), (2, "z")])
def test_what_has_feet_stands_on_them(axis, up, name):
    assert fit_of(mesh(table(axis)), Path(name)).up == up


@pytest.mark.parametrize("name", ["a.ply", "a.obj"])
@pytest.mark.parametrize("front", [*np.eye(3), *-np.eye(3), (0.36, 0.48, 0.8), (0.48, -0.8, 0.36)])
def test_a_flat_mesh_leans_back_with_its_front_to_the_camera(front, name):
    across = np.cross(front, np.roll(front, 1))
    sheet = np.array([[a, b] for a in (-2, 2) for b in (3, 6)]) @ [across, np.cross(front, across)]
    fit = fit_of(mesh(sheet.astype(np.float32), front), Path(name))
    lean = np.radians(40.0)
    assert fit.rotation @ front == pytest.approx([0.0, -np.cos(lean), np.sin(lean)], abs=1e-6)
    assert np.linalg.det(fit.rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("up", ["z", "-z"])
def test_a_flat_mesh_lies_over_the_floor_where_its_axis_is_given(up):
    sheet = table(2) * [1.0, 1.0, 0.0]
    fit = fit_of(mesh(sheet), FILE, up)
    heights = (fit.scale * (sheet @ fit.rotation.T) + fit.shift)[:, 2]
    assert 0.0 < heights.min() == heights.max() < 0.1


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


@pytest.mark.parametrize("name", ["has_vertex_texcoords", "has_texcoords"], ids=["3.9", "3.10"])
def test_texture_coordinates_are_found_by_either_name(name: str):
    for present in (True, False):
        assert has_texcoords(SimpleNamespace(**{name: lambda p=present: p})) == present


@pytest.mark.parametrize("name", ["scalar_rgb", "llvm_ad_rgb"])
def test_mesh_of_the_installed_mitsuba_is_read(name: str):
    mi.set_variant(name)
    arrays = mesh_arrays(mi.load_dict({"type": "cube"}))
    assert arrays.positions.shape == (24, 3)
    assert arrays.faces.shape == (12, 3)
    assert arrays.normals is not None
    assert arrays.uv is not None
    # unit normals across the faces of a cube from −1 to 1
    across = np.einsum(
        "fc,fc->f", arrays.positions[arrays.faces[:, 0]], arrays.normals[arrays.faces[:, 0]]
    )
    np.testing.assert_allclose(across, 1.0, rtol=1e-6)


@pytest.mark.parametrize("name", ["scalar_rgb", "llvm_ad_rgb"])
def test_mesh_without_normals_and_texture_coordinates_has_neither(name: str, tmp_path: Path):
    mi.set_variant(name)
    (tmp_path / "a.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    file = {"type": "obj", "filename": str(tmp_path / "a.obj"), "face_normals": True}
    arrays = mesh_arrays(mi.load_dict(file))
    assert arrays[1:3] == (None, None)
    np.testing.assert_array_equal(arrays.faces, [[0, 1, 2]])
