"""The figures of a plan are those that `plan` wrote, and nothing else."""

from __future__ import annotations

import json

import pytest

from docs.make.figures import plan


def report() -> dict:
    """As `plan --json` writes it."""
    one = {"memory_mb": 8.5, "sampling_memory_mb": 14.0, "terms": "1 x 8"}
    return {
        "tables": [
            {
                "asked for": {
                    "frequency (rad/µm)": {"light can probe": 34.9},
                    "kappa (rad/µm)": {"the table has": 52.4},
                },
                "needs": {"frequency (rad/µm), along x and y": [20.5, 6.5], "kappa (rad/µm)": 35.0},
                "whole": one,
                "planned": one | {"memory_mb": 1.0},
                "times less memory": 8.5,
            }
        ],
        "picture, planned against whole, same random numbers": {
            "mean difference / mean (XYZ)": 6e-5,
            "delta E 2000, mean": 0.01,
            "delta E 2000, 99 %": 0.1,
        },
    }


def test_pages_show_what_was_measured(tmp_path):
    file, page = tmp_path / "plan.json", tmp_path / "page.md"
    file.write_text(json.dumps(report()), "utf-8")
    page.write_text("<!-- begin plan -->\nstale\n<!-- end plan -->\n", "utf-8")
    assert plan.main([str(file), "-o", str(page)]) == 0
    text = page.read_text("utf-8")
    assert "| table | 8.5 MB | 1 MB |" in text
    assert "up to 20.5 and 6.5 along x and y" in text
    assert "8.5 times less memory" in text
    assert "stale" not in text


@pytest.mark.parametrize("content", ["{", "[]", "{}", '{"tables": []}'])
def test_another_file_is_refused_in_one_line(tmp_path, capsys, content):
    file = tmp_path / "plan.json"
    file.write_text(content, "utf-8")
    assert plan.main([str(file), "-o", str(tmp_path / "page.md")]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_a_page_without_markers_is_refused(tmp_path, capsys):
    file, page = tmp_path / "plan.json", tmp_path / "page.md"
    file.write_text(json.dumps(report()), "utf-8")
    page.write_text("nothing", "utf-8")
    assert plan.main([str(file), "-o", str(page)]) == 1
    assert "has none of the markers" in capsys.readouterr().err
