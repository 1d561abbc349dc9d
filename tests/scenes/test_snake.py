"""The snake: closed, smooth, scaled, with tangents along its body."""

from __future__ import annotations

import re
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from mitsuba_diffraction import DiffractionError
from mitsuba_diffraction.scene.orientation import load_mesh
from scenes.make.__main__ import elaphe, main, xenopeltis
from scenes.make.anatomy import Anatomy
from scenes.make.snake import Snake
from scenes.make.spine import coil
from tests.support import ROOT

pytestmark = pytest.mark.thorough


@pytest.fixture(scope="module", params=[elaphe, xenopeltis])
def committed(request: pytest.FixtureRequest) -> tuple[str, Snake]:
    return request.param.__name__, request.param()


def test_the_committed_bodies_are_closed(committed: tuple[str, Snake]) -> None:
    _assert_closed(committed[1])


def _assert_closed(snake: Snake) -> None:
    """Every edge, welded by position, is shared by two faces that run along it both ways."""
    positions, faces = snake.body.positions, snake.body.faces
    # cm; well below the smallest cell and above rounding
    pairs = cKDTree(positions).query_pairs(1e-6, output_type="ndarray")
    graph = coo_matrix((np.ones(len(pairs)), pairs.T), 2 * (len(positions),))
    welded = connected_components(graph)[1][faces]
    welded = welded[(np.diff(np.sort(welded, axis=1), axis=1) > 0).all(axis=1)]
    edges = np.concatenate([welded[:, [0, 1]], welded[:, [1, 2]], welded[:, [2, 0]]])
    counts = Counter(map(tuple, edges.tolist()))
    assert set(counts.values()) == {1}
    assert all((b, a) in counts for a, b in counts)


def test_the_scenes_hold_what_the_generator_makes(committed: tuple[str, Snake]) -> None:
    name, snake = committed
    read = load_mesh(ROOT / "scenes" / "meshes" / f"{name}.ply")
    faces = read.faces
    # corner by corner: a vertex at the tip belongs to no triangle, and is not read
    made, corners = snake.body, snake.body.faces
    # single precision, and other versions of SciPy's splines
    np.testing.assert_allclose(read.positions[faces], made.positions[corners], atol=1e-3)
    np.testing.assert_allclose(read.uv[faces], made.uv[corners], atol=1e-4)
    np.testing.assert_allclose(read.normals[faces], made.normals[corners], atol=1e-2)


def test_pigment_covers_the_whole_body(committed: tuple[str, Snake]) -> None:
    name, snake = committed
    scene = {"elaphe": "snake.xml", "xenopeltis": "xenopeltis.xml"}[name]
    text = (ROOT / "scenes" / scene).read_text()
    scale = float(re.search(r'"pigment_scale" value="([^"]+)"', text)[1])
    # a thousandth of the length is a millimetre of tail tip
    assert scale * snake.skin.u_max == pytest.approx(1, abs=1e-3)


@given(
    st.fixed_dictionaries(
        {},
        optional={
            "length": st.floats(),
            "girth_radius": st.floats(),
            "taper": st.floats(),
            "head": st.floats(),
        },
    ),
    st.floats(),
)
@settings(max_examples=60)
def test_any_proportions_work_or_are_refused_in_one_line(
    proportions: dict[str, float], coils: float
) -> None:
    try:
        spine = coil(Anatomy(**proportions), coils)
    except DiffractionError as error:
        assert str(error).startswith("snake: ")
        assert "\n" not in str(error)
    else:
        assert np.isfinite(spine).all()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--rows", "18"], "rows = 18 is even"),
        (["--coils", "4"], "coils = 4 do not fit"),
        (["--keel", "nan"], "keel = nan is outside 0 to 1"),
        (["--length", "5"], "length = 5 is outside"),
        (["--head-detail", "2"], "head_detail = 2 is outside 8 to 1000"),
    ],
)
def test_bad_options_are_one_line(
    options: list[str],
    words: str,
    tmp_path: object,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["snake", "-o", f"{tmp_path}/snake.ply", *options]) == 1
    error = capsys.readouterr().err
    assert words in error
    assert error.count("\n") == 1


def test_the_command_writes_a_snake_with_orientation(
    tmp_path: object, capsys: pytest.CaptureFixture[str], variant: str
) -> None:
    import mitsuba as mi

    path, eyes = f"{tmp_path}/snake.ply", f"{tmp_path}/eyes.ply"
    coarse = ["--detail", "1", "--head-detail", "12", "--fan", "20"]
    assert main(["snake", "-o", path, "--eyes", eyes, *coarse]) == 0
    assert "(pigment_scale=0.049998)" in capsys.readouterr().out
    body = mi.load_dict({"type": "ply", "filename": path})
    assert body.has_vertex_normals()
    assert body.has_vertex_texcoords()
    turn = np.array(mi.traverse(body)["vertex_orientation"]).reshape(-1, 3)
    # 20° at the side corners of scales, single precision
    assert np.degrees(np.arctan2(turn[:, 1], turn[:, 0])).max() == pytest.approx(20, abs=1e-4)
    np.testing.assert_allclose(np.hypot(turn[:, 0], turn[:, 1]), 1, atol=1e-6)
    assert mi.load_dict({"type": "ply", "filename": eyes}).face_count() > 1000
