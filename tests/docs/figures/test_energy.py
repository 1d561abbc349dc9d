"""The table of docs/energy.md is what `info --energy` found, and nothing else."""

from __future__ import annotations

import json

from docs.make.figures import energy

METAL = {
    "model": "small_slope",
    "albedo": [0.729, 1.409],
    "albedo, conserved": [0.729, 0.996],
    "taken, largest": 0.29,
    "taken at": {"0°": -0.0001, "45°": 0.004, "60°": 0.093, "75°": 0.278},
    "conserved over raw where that is at most 1": [0.975, 1.001],
    "within 1 % there": 0.958,
    "conserved where raw is above 1": [0.963, 0.996],
    "between 0.97 and 1.001 there": 0.984,
    "reciprocity lets be kept": 0.968,
}
GLASS = {
    key: value
    for key, value in METAL.items()
    if "above 1" not in key and "there" not in key[-6:] and "reciprocity" not in key
} | {"within 1 % there": 1.0}


def test_the_page_shows_what_was_found(tmp_path):
    file, page = tmp_path / "cd.json", tmp_path / "page.md"
    file.write_text(json.dumps({"energy": {"glass": GLASS, "metal": METAL}}), "utf-8")
    page.write_text("<!-- begin energy -->\nstale\n<!-- end energy -->\n", "utf-8")
    assert energy.main([str(file), "-o", str(page)]) == 0
    lines = page.read_text("utf-8").splitlines()
    glass, metal = (
        next(line for line in lines if f"| {name} |" in line) for name in ("glass", "metal")
    )
    assert glass.startswith("| cd | glass | 0.729–1.409 | 0.729–0.996 | 0.0, 0.4, 9.3, 27.8 % |")
    assert glass.endswith("| 100 % | – | – | – |")
    assert metal.endswith("| 96 % | 0.963–0.996 | 98 % | 0.968 |")


def test_another_file_is_refused_in_one_line(tmp_path, capsys):
    file = tmp_path / "other.json"
    file.write_text("{}", "utf-8")
    assert energy.main([str(file), "-o", str(tmp_path / "page.md")]) == 1
    assert "make energy" in capsys.readouterr().err
