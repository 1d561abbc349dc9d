"""The pages' figures are those that commands wrote, and nothing else."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from docs.make.figures import tables


def bench(value: float = 2.0, *, met: bool = True) -> dict[str, Any]:
    """As `bench --json` writes it, every number the same."""
    machine = {"cores": 2, "processor": "Abacus", "mitsuba": "3.9.1", "mitsuba_diffraction": "0.1"}
    # each figure looks for the first section and row that fit: give the numbers to all of them
    values = {figure.column: value for figure in tables.FIGURES}
    goals = [{"goal": f"goal {n}", "met": met} for n in range(3)]
    sections = [
        {
            "title": f"{figure.section}: somehow",
            "rows": [{"name": f"{figure.row} and more", "values": values, "goals": goals}],
        }
        for figure in tables.FIGURES
    ]
    return {"machine": machine, "sections": sections}


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
}
GLASS = {
    key: value for key, value in METAL.items() if "above 1" not in key and "there" not in key[-6:]
} | {"within 1 % there": 1.0}


def page(folder: Path, name: str) -> Path:
    file = folder / "page.md"
    file.write_text(f"above\n<!-- begin {name} -->\nstale\n<!-- end {name} -->\nbelow\n", "utf-8")
    return file


def written(folder: Path, name: str, *documents: dict[str, Any], part: str | None = None) -> str:
    """What the page shows of documents."""
    target, files = page(folder, part or name), []
    for n, document in enumerate(documents):
        files.append(folder / f"{name}{n}.json")
        files[-1].write_text(json.dumps(document), "utf-8")
    assert tables.main([name, *map(str, files), "-o", str(target)]) == 0
    text = target.read_text("utf-8")
    assert text.startswith("above\n")
    assert text.endswith("below\n")
    assert "stale" not in text
    return text


def test_speed_has_all_measured_numbers_and_goals(tmp_path):
    text = written(tmp_path, "speed", bench())
    assert "2 cores (Abacus)" in text
    assert len([line for line in text.splitlines() if line.startswith("|")]) == 2 + len(
        tables.FIGURES
    )
    assert "| `eval` / `roughconductor` (Al) | 2.0 | goal 0 |" in text


def test_energy_has_rows_of_all_files(tmp_path):
    found = {"energy": {"glass": GLASS, "metal": METAL}}
    lines = written(tmp_path, "energy", found, found).splitlines()[2:-2]
    head, _, glass, metal, *others = lines
    assert head.startswith("| table | material |")
    assert glass.startswith(
        "| energy0 | glass | 0.729–1.409 | 0.729–0.996 | 0.0, 0.4, 9.3, 27.8 % |"
    )
    assert glass.endswith("| 100 % | – | – |")
    assert metal.endswith("| 96 % | 0.963–0.996 | 98 % |")
    assert others == [line.replace("energy0", "energy1") for line in (glass, metal)]


def test_a_sweep_has_a_row_for_each_value(tmp_path):
    steps = [{"value": nm, "delta_e_mean": apart} for nm, apart in ((1.0, 0.0), (5.0, 1.06))]
    report = {"sweep": "wavelength-step", "steps": steps}
    rows = written(tmp_path, "sweep", report, part="wavelength-step").splitlines()[2:-2]
    assert rows[2:] == ["| 1 nm | reference |", "| 5 nm | 1.1 |"]
    report = {"sweep": "light-angle", "steps": [{"value": 30.0, "delta_e_mean": None}]}
    assert "| 30° |  |" in written(tmp_path, "sweep", report, part="light-angle")
