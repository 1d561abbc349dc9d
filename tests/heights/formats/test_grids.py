"""Grids of numbers in text become heights; anything else is one clear line."""

from __future__ import annotations

import numpy as np
import pytest

from mitsuba_diffraction.errors import DiffractionError, DiffractionWarning
from mitsuba_diffraction.heights.field import HeightField
from tests.support.refusals import refusal

GRID = [[0.1, 0.2, 0.3, 0.4], [0.5, 0.6, 0.7, 0.8]]


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.txt", "0.1 0.2 0.3 0.4\n0.5  0.6 0.7 0.8\n"),
        ("a.txt", "# a comment\n\n0.1\t0.2\t0.3\t0.4\r\n0.5\t0.6\t0.7\t0.8"),
        ("a.csv", "0.1,0.2,0.3,0.4\n0.5, 0.6, 0.7, 8e-1\n"),
        ("a.csv", "0.1,0.2,0.3,0.4,\n0.5,0.6,0.7,0.8,\n"),
        ("a.csv", "0,1;0,2;0,3;0,4\n0,5;0,6;0,7;0,8\n"),
        ("a.tsv", "\ufeff0,1\t0,2\t0,3\t0,4\n0,5\t0,6\t0,7\t0,8\n"),
    ],
)
def test_a_grid_in_micrometres_has_its_first_line_on_top(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8", newline="")
    field = HeightField.load(path, pixel_size=0.1)
    assert field.heights.tolist() == GRID[::-1]


@pytest.mark.parametrize(
    ("header", "rows", "extent", "span"),
    [
        ("# Width: 8.00 µm\n# Height: 2000 nm\n# Value units: nm", "1 2 3\n4 5 6", (8, 2), 5e-3),
        (
            "# Breite: 12,34 µm\n# Höhe: 5678,9 nm\n# Value units: nm",
            "1 1,5 3\n-2 -3 -6\n0 0 0\n9 9 9", (12.34, 5.6789), 0.015,
        ),
        # three pixels wide, and no list of points
        ("# Width: 3 um\n# Height: 4 um", "1 2 3\n" * 4, (3, 4), 2.0),
    ],
)  # fmt: skip
def test_an_exported_header_gives_size_and_unit(tmp_path, header, rows, extent, span):
    (tmp_path / "a.txt").write_text(f"# Channel: Topography\n{header}\n{rows}\n", encoding="utf-8")
    field = HeightField.load(tmp_path / "a.txt", level="none")
    assert field.shape == (rows.strip().count("\n") + 1, len(rows.split("\n")[0].split()))
    assert field.extent == pytest.approx(extent)
    assert field.range == pytest.approx(span)


def test_points_on_a_regular_grid_are_arranged(tmp_path):
    path = tmp_path / "a.csv"
    points = [(x * 0.5, y * 0.25, 10 * y + x) for y in range(3) for x in range(4)]
    points = np.random.default_rng(0).permutation(points)
    np.savetxt(path, points, delimiter=",")
    field = HeightField.load(path)
    assert field.pixel_size == (0.5, 0.25)
    assert field.heights.tolist() == [[0, 1, 2, 3], [10, 11, 12, 13], [20, 21, 22, 23]]


@pytest.mark.parametrize(
    ("header", "order"),
    [("z [um],x [um],y [um]", (2, 0, 1)), ("y_um,x_um,height_um", (1, 0, 2)), ("Y;X;H", (1, 0, 2)),
     ("# height,y,x", (2, 1, 0)), ("a,b,c", (0, 1, 2))],
)  # fmt: skip
def test_columns_of_points_have_the_order_of_their_names(tmp_path, header, order):
    points = np.array([(x * 0.5, y * 0.25, 10 * y + x) for y in range(3) for x in range(4)])
    mark = ";" if ";" in header else ","
    for name, columns in (("named.csv", order), ("plain.csv", (0, 1, 2))):
        text = {"delimiter": mark, "comments": ""} | (
            {"header": header} if columns is order else {}
        )
        np.savetxt(tmp_path / name, points[:, columns], **text)
    named, plain = (HeightField.load(tmp_path / n) for n in ("named.csv", "plain.csv"))
    assert named.pixel_size == plain.pixel_size
    np.testing.assert_array_equal(named.heights, plain.heights)


@pytest.mark.parametrize("head", ["x(nm) y(µm) z(pm)", "# x [nm] y [um] z [pm]"])
def test_each_column_of_points_has_its_own_unit(tmp_path, head):
    path = tmp_path / "a.txt"
    rows = [f"{1e3 * x:g} {0.5 * y:g} {100.0 * (x + y):g}" for y in range(2) for x in range(3)]
    path.write_text("\n".join([head, *rows]), "utf-8")
    field = HeightField.load(path, level="none")
    assert field.pixel_size == (1.0, 0.5)
    assert field.heights[1] == pytest.approx([1e-4, 2e-4, 3e-4])


def test_missing_cells_are_filled_if_asked(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("1,1,1,1\n1,,nan,1\n1,1,1,1\n")
    with pytest.raises(DiffractionError, match=r"2 of 12 points.*fill"):
        HeightField.load(path, pixel_size=0.1)
    field = HeightField.load(path, pixel_size=0.1, fill="nearest")
    assert field.range == 0
    assert "nearest" in field.history[0]


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("1 2 3\n4 5\n", "line 2"),
        ("1 2 3\n4 five 6\n", "five"),
        ("x,y\n1,2\n", "line 1"),
        ("# nothing\n", "no line of numbers"),
        ("1\n2\n3\n", "line scan"),
        ("1 2 3 4\n", "line scan"),
        ("0 0 1\n1 0 1\n0 1 1\n5 7 1\n", "uniform grid"),
        ("0 0 1\n1 0 1\n0 1 1\n1 1 1\n3 0 1\n3 1 1\n", "uniform grid"),
        ("nan nan nan\n" * 5, "uniform grid"),
        ("nan nan nan nan\n" * 5, "empty"),
        ("# Value units: V\n1 2\n3 4\n", "not a length"),
        ("# Width: 1 furlong\n1 2\n3 4\n", "furlong"),
        ("# Width: 0 nm\n# Height: 1 nm\n1 2\n3 4\n", "size"),
        ("nan nan\nnan nan\n", "no line|empty|line scan"),
        ("1e300 1\n1 1\n", "in µm"),
        ("0 1\n0.1 4\n0.2 2\n0.3 2\n", "profile of 4 points"),
        (b"\xff\xfe\x00\x01" * 9, "not text"),
    ],
)
def test_what_is_no_grid_is_refused(tmp_path, text, word):
    path = tmp_path / "a.txt"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    with pytest.raises(DiffractionError, match=word) as caught:
        HeightField.load(path, pixel_size=0.1)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "line",
    ["# Value units: nm", "# Value unit: nm", "# units: nm", "# z unit = nm", "# height in nm",
     "# All heights are in nm.", "# values in nm", "# Height [nm]", "Height [nm]", "Z sensor (nm)",
     '"Height [nm]",,,'],
)  # fmt: skip
def test_a_unit_that_a_line_above_the_grid_states_is_that_of_the_heights(tmp_path, line):
    file = tmp_path / "mirror.csv"
    file.write_text(f"{line}\n0.5,0.25\n0.75,1\n", encoding="utf-8")
    assert HeightField.load(file, pixel_size=0.5, level="none").heights.max() == pytest.approx(1e-3)


@pytest.mark.parametrize(
    "line", ["# heights of nm size", "# Height: nm", "# z-unit = nm", "# Data in nanometers"]
)
def test_a_unit_that_is_perhaps_not_the_heights_is_asked_about(tmp_path, line):
    (tmp_path / "a.txt").write_text(f"{line}\n0.5 0.25\n0.75 1\n", encoding="utf-8")
    with pytest.warns(DiffractionWarning, match="Give height_unit"):
        HeightField.load(tmp_path / "a.txt", pixel_size=0.5)
    field = HeightField.load(tmp_path / "a.txt", pixel_size=0.5, height_unit="nm", level="none")
    assert field.heights.max() == pytest.approx(1e-3)


@pytest.mark.parametrize("line", ["# Height (retrace)", "# 9 rows in all", "# Value units: um"])
def test_other_comments_state_no_unit(tmp_path, line):
    (tmp_path / "a.txt").write_text(f"{line}\n0.5 0.25\n0.75 1\n", encoding="utf-8")
    assert HeightField.load(tmp_path / "a.txt", pixel_size=0.5, level="none").heights.max() == 1.0


def test_a_unit_that_is_no_length_is_overridden_by_height_unit(tmp_path):
    (tmp_path / "a.txt").write_text("# heights in V\n1 2\n3 4\n", encoding="utf-8")
    assert "'V', not a length" in refusal(tmp_path / "a.txt", pixel_size=0.5)
    with pytest.warns(DiffractionWarning, match="not V"):
        field = HeightField.load(tmp_path / "a.txt", pixel_size=5.0, height_unit="um")
    assert field.range == 3.0


POINTS = [(x * 0.5, y * 0.25, 10 * y + x) for y in range(3) for x in range(4)]


def test_points_in_metres_say_what_to_give(tmp_path):
    file = tmp_path / "a.txt"
    np.savetxt(file, np.array(POINTS) * 1e-6)
    line = refusal(file)
    assert "5e-07 x 2.5e-07 µm" in line
    words = dict(word.split("=") for word in line.split() if "=" in word)
    with pytest.warns(DiffractionWarning):
        field = HeightField.load(file, **words, level="none")
    assert field.pixel_size == (0.5, 0.25)
    assert field.range == pytest.approx(23.0)


@pytest.mark.parametrize("gap", ["0.5,0.25,nan", "0.5,0.25,", "nan,nan,nan", None])
def test_points_without_a_height_are_gaps(tmp_path, gap):
    lines = [",".join(map(str, point)) for point in POINTS]
    lines[5:6] = [] if gap is None else [gap]
    (tmp_path / "a.csv").write_text("\n".join(lines), "utf-8")
    assert "1 of 12 points" in refusal(tmp_path / "a.csv")
    field = HeightField.load(tmp_path / "a.csv", fill="nearest", level="none")
    assert field.pixel_size == (0.5, 0.25)
    assert field.heights[2, 3] == 23.0


@pytest.mark.parametrize("corner", ["", "0", "-0.05"])
@pytest.mark.parametrize("step", [1.0, 0.05, -0.0488])
def test_labels_of_rows_and_columns_are_no_heights(tmp_path, corner, step):
    """As pandas writes an index, and spreadsheets x and y, rounded to few digits."""
    heights = np.random.default_rng(1).random((5, 6)).round(3)
    rows = [",".join(map(str, row)) for row in heights]
    names = ",".join(f"{step * n:.4g}" for n in range(6))
    labelled = [f"{corner},{names}", *(f"{step * n:.4g},{row}" for n, row in enumerate(rows))]
    file = tmp_path / "a.csv"
    file.write_text("\n".join(labelled), "utf-8")
    with pytest.warns(DiffractionWarning, match="labels"):
        field = HeightField.load(file, pixel_size=5.0, level="none")
    assert np.array_equal(field.heights, heights[::-1])
    for part in ([names, *rows], labelled[1:]):
        file.write_text("\n".join(part), "utf-8")
        assert "labels" in refusal(file, pixel_size=5.0)


X, Y = np.meshgrid(np.arange(6.0), np.arange(5.0))


@pytest.mark.parametrize(
    "heights", [X + Y, X * Y, (X + Y) % 6, np.round(X * Y**2), np.where(Y == 0, X, (X + Y) % 4)]
)
def test_ramps_and_sawteeth_are_no_labels(tmp_path, heights):
    np.savetxt(tmp_path / "a.csv", heights, "%g", ",")
    field = HeightField.load(tmp_path / "a.csv", pixel_size=5.0, level="none")
    assert np.array_equal(field.heights, heights[::-1])


def test_a_title_above_a_grid_is_no_row_of_it(tmp_path):
    file = tmp_path / "a.csv"
    file.write_text("Sample A,,,,\nScan 3 of 2024-05-01\nHeight [nm]\n1,2,3,5\n4,5,6,9\n", "utf-8")
    field = HeightField.load(file, pixel_size=5.0, level="none")
    np.testing.assert_allclose(field.heights[0], [4e-3, 5e-3, 6e-3, 9e-3])


@pytest.mark.parametrize("line", ["1,2,?,5", "a,b,c,d", "y/x,0,5,10,15", "1,2,?"])
def test_names_of_columns_and_damaged_rows_say_what_to_do(tmp_path, line):
    file = tmp_path / "a.csv"
    file.write_text(f"{line}\n1,2,3,5\n4,5,6,9\n", "utf-8")
    assert "line 1: " in (told := refusal(file, pixel_size=5.0))
    assert told.endswith("delete this line, or begin it with #")
    file.write_text(f"# {line}\n1,2,3,5\n4,5,6,9\n", "utf-8")
    assert HeightField.load(file, pixel_size=5.0).shape == (2, 4)
