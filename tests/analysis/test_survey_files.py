"""Files of a survey: stored rows are checked, and no cell is a formula."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction.analysis.survey import Measured, _store, _stored_row
from mitsuba_diffraction.analysis.survey_files import write_sheets
from mitsuba_diffraction.columns import save_rows

JOB = SimpleNamespace(key="0" * 32)
STEM = f"a-{JOB.key}"
ROW = {
    "reason": "", "width_um": 12.0, "iridescence": 0.1, "iridescence_by_chance": 1.0 / 3.0,
    "iridescent_light": 0.05, "tiling": "", "patches": 1,
}  # fmt: skip
SHOWN = ROW | {"table": f"scans/{STEM}.exr", "map": f"scans/{STEM}.png"}


@pytest.fixture
def scans(tmp_path):
    """A folder with a scan's row, map and table."""
    folder, picture = tmp_path / "scans", io.BytesIO()
    folder.mkdir()
    Image.fromarray(np.zeros((4, 4, 4), np.uint8), "RGBA").save(picture, "PNG")
    files = {".png": picture.getvalue(), ".exr": b"a table"}
    assert _store(folder, Path("a.npy"), JOB, Measured(ROW, files)) == SHOWN
    return folder


def test_a_stored_row_is_read_with_the_files_beside_it(scans, tmp_path):
    assert _stored_row(scans, JOB) == SHOWN
    write_sheets(tmp_path, [{"file": "a", **_stored_row(scans, JOB)}])
    assert (tmp_path / "sheet.png").exists()


def test_the_row_of_a_scan_that_cannot_be_read_has_no_files(tmp_path):
    failed = {"reason": "'a.npy' is damaged", "time_s": 0.1}
    assert _store(tmp_path, Path("a.npy"), JOB, Measured(failed, {})) == failed
    assert _stored_row(tmp_path, JOB) == failed


@pytest.mark.parametrize(
    "text",
    [
        "", "[]", "null", "{}", '"reason"', "[" * 5000, '[{"reason": ""}, ""]', "[1, 2]",
        json.dumps(ROW), json.dumps([ROW, ""]), json.dumps([ROW | {"reason": "failed"}, ""]),
        '{"reason": "", "patches": ' + 5000 * "9" + "}", "\u0000",
    ],
)  # fmt: skip
def test_a_damaged_row_is_measured_again(scans, text):
    (scans / f"{STEM}.json").write_text(text)
    assert _stored_row(scans, JOB) is None


@pytest.mark.parametrize(("old", "new"), [("12.0", "12.5"), ('"tiling": ""', '"tiling": 3'),
                                          ('"width_um": 12.0, ', ""), ("0.1", "true")])  # fmt: skip
def test_a_changed_row_is_measured_again(scans, old, new):
    file = scans / f"{STEM}.json"
    text = file.read_text("utf-8")
    assert old in text
    file.write_text(text.replace(old, new, 1))
    assert _stored_row(scans, JOB) is None


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_a_row_with_other_files_is_measured_again(scans, tmp_path, suffix):
    """As a link to a picture that somebody else may not see."""
    file, other = scans / f"{STEM}{suffix}", tmp_path / "elsewhere"
    file.unlink()
    assert _stored_row(scans, JOB) is None
    other.write_bytes(b"of somebody else")
    file.symlink_to(other)
    assert _stored_row(scans, JOB) is None


@pytest.mark.parametrize("text", ["=cmd()", "+1", "-a.npy", "@x", "\tx"])
def test_no_cell_begins_a_formula(tmp_path, text):
    save_rows(tmp_path / "a.csv", ["file", "number"], [{"file": text, "number": -1.5}])
    with open(tmp_path / "a.csv", newline="") as file:
        _, (shown, number) = csv.reader(file)
    assert shown == f"'{text}"
    assert float(number) == -1.5


def test_a_name_with_line_ends_is_one_cell(tmp_path):
    save_rows(tmp_path / "a.csv", ["file", "number"], [{"file": "a\r=x\nb", "number": 1}])
    with open(tmp_path / "a.csv", newline="") as file:
        assert len([*csv.reader(file)]) == 2
