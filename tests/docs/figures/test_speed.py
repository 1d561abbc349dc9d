"""The page's figures are those that `bench` wrote, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from docs.make.figures import speed


def measured(value: float = 2.0, *, met: bool = True) -> dict:
    """As `bench --json` writes it, every number the same."""
    machine = {"cores": 2, "processor": "Abacus", "mitsuba": "3.9.1", "mitsuba_diffraction": "0.1"}
    sections = [
        {
            "title": f"{figure.section}: somehow",
            "rows": [
                {
                    "name": f"{figure.row} and more",
                    "values": {figure.column: value},
                    "goals": [{"goal": f"goal {n}", "met": met} for n in range(3)],
                }
            ],
        }
        for figure in speed.FIGURES
    ]
    return {"machine": machine, "sections": sections}


def page(folder: Path) -> Path:
    file = folder / "page.md"
    file.write_text("above\n<!-- begin speed -->\nstale\n<!-- end speed -->\nbelow\n", "utf-8")
    return file


def test_the_measured_numbers_and_goals_are_shown(tmp_path):
    data = measured()
    # each figure looks for the first section and row that fit: give the numbers to all of them
    for section in data["sections"]:
        for figure in speed.FIGURES:
            section["rows"][0]["values"][figure.column] = 2.0
    file = tmp_path / "bench.json"
    file.write_text(json.dumps(data), "utf-8")
    assert speed.main([str(file), "-o", str(page(tmp_path))]) == 0
    text = (tmp_path / "page.md").read_text("utf-8")
    assert text.startswith("above\n")
    assert text.endswith("below\n")
    assert "stale" not in text
    assert "2 cores (Abacus)" in text
    assert len([line for line in text.splitlines() if line.startswith("|")]) == 2 + len(
        speed.FIGURES
    )
    assert "| `eval` / `roughconductor` (Al) | 2.0 | goal 0 |" in text


def test_a_missed_goal_is_shown_as_missed():
    data = measured(met=False)
    for section in data["sections"]:
        for figure in speed.FIGURES:
            section["rows"][0]["values"][figure.column] = 2.0
    assert "**missed:** goal 0" in speed.table(data)


@pytest.mark.parametrize("content", ["{", "[]", '{"machine": {}, "sections": []}'])
def test_another_file_is_refused_in_one_line(tmp_path, capsys, content):
    file = tmp_path / "bench.json"
    file.write_text(content, "utf-8")
    target = page(tmp_path)
    assert speed.main([str(file), "-o", str(target)]) == 1
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "bench" in said
    assert "stale" in target.read_text("utf-8")
