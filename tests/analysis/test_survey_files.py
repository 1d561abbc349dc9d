"""Files of a survey: stored rows are checked, and no cell is a formula."""

from __future__ import annotations

import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction.analysis.survey import _stored_row
from mitsuba_diffraction.analysis.survey_files import write_sheets
from mitsuba_diffraction.columns import save_rows

JOB = SimpleNamespace(key="0" * 32)
ROW = {
    "reason": "", "width_um": 12.0, "iridescence": 0.1, "iridescence_by_chance": 0.02,
    "iridescent_light": 0.05, "tiling": "", "ranked_among": "scans from 10 µm", "patches": 1,
    "table": f"scans/a-{JOB.key}.exr", "map": f"scans/a-{JOB.key}.png",
}  # fmt: skip


@pytest.fixture
def scans(tmp_path):
    """A folder with a scan's map and table."""
    folder = tmp_path / "scans"
    folder.mkdir()
    Image.fromarray(np.zeros((4, 4, 4), np.uint8), "RGBA").save(folder / f"a-{JOB.key}.png")
    (folder / f"a-{JOB.key}.exr").touch()
    return folder


def _write(scans, text):
    (scans / f"a-{JOB.key}.json").write_text(text)


def test_a_stored_row_is_read(scans):
    _write(scans, json.dumps(ROW))
    assert _stored_row(scans, JOB) == ROW


@pytest.mark.parametrize(
    "text",
    [
        "", "[]", "null", "{}", '"reason"', "[" * 5000, '{"reason": ""}', '{"reason": 1}',
        json.dumps(ROW | {"iridescence": "much"}), json.dumps(ROW | {"tiling": 3}),
        json.dumps(ROW | {"width_um": {}}), json.dumps(ROW | {"patches": 10**400}),
        json.dumps(ROW | {"period_1_um": 1.0}), json.dumps(ROW | {"iridescence": True}),
        json.dumps({k: v for k, v in ROW.items() if k != "width_um"}),
        '{"reason": "", "patches": ' + 5000 * "9" + "}", "\u0000",
    ],
)  # fmt: skip
def test_a_damaged_row_is_measured_again(scans, text):
    _write(scans, text)
    assert _stored_row(scans, JOB) is None


@pytest.mark.parametrize("name", ["../private.png", "/etc/hostname", "scans/../../private.png"])
def test_a_row_shows_the_scans_own_map_whatever_it_names(scans, tmp_path, name):
    Image.fromarray(np.full((4, 4, 3), 255, np.uint8)).save(tmp_path.parent / "private.png")
    _write(scans, json.dumps(ROW | {"map": name, "table": name}))
    assert _stored_row(scans, JOB) == ROW
    write_sheets(tmp_path, [{"file": "a", **_stored_row(scans, JOB)}])
    assert (tmp_path / "sheet.png").exists()


def test_a_map_that_is_a_link_or_no_picture_is_measured_again(scans, tmp_path):
    _write(scans, json.dumps(ROW))
    picture = scans / f"a-{JOB.key}.png"
    picture.rename(tmp_path / "elsewhere.png")
    picture.symlink_to(tmp_path / "elsewhere.png")
    assert _stored_row(scans, JOB) is None
    picture.unlink()
    picture.write_bytes(b"\x89PNG\r\n\x1a\n and no more")
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
