"""A survey of scans, one of them damaged, on two workers."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction import gratings
from tests.support.coarse import coarse_energy

pytestmark = pytest.mark.thorough

OPTIONS = (
    "--coherence-width", 6, "--tolerance", 0.05, "--resolution", 24,
    "--treatments", "treatments.toml", "--threads", 1, "-o", "out",
)  # fmt: skip
TREATMENTS = """
["*.bmp"]
pixel_size = 0.025
max_height = 0.25
["*.npy"]
pixel_size = 0.0833
"""


@pytest.fixture
def scans(tmp_path, monkeypatch):
    """Four periods of a blazed grating as a picture, two look-alikes and a damaged file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "treatments.toml").write_text(TREATMENTS)
    made = {"elaphe": gratings.elaphe_like(8.0, 96), "disc": gratings.cd(8.0, 96)}
    for name, field in made.items():
        np.save(f"{name}.npy", field.heights)
    whole = (tmp_path / "disc.npy").read_bytes()
    (tmp_path / "damaged.npy").write_bytes(whole[: len(whole) // 2])
    periods = np.tile(np.linspace(0, 255, 100).astype(np.uint8), (400, 4))
    Image.fromarray(periods).save("blazed.bmp")
    return [tmp_path / "blazed.bmp", *(tmp_path / f"{name}.npy" for name in (*made, "damaged"))]


def test_a_survey_on_two_workers_and_what_is_new_in_the_next(client, scans, run, tmp_path):
    client.run(coarse_energy)
    command = "survey", *OPTIONS, "--scheduler", client.scheduler.address
    ran = run(*command, *scans[:-2], scans[-1])
    assert ran.code == 1, ran
    assert "1 failed" in ran.out, ran
    assert "damaged.npy" in ran.err

    first = {path: path.stat().st_mtime_ns for path in (tmp_path / "out" / "scans").iterdir()}
    ran = run(*command, *scans)
    assert ran.code == 1, ran
    second = {path: path.stat().st_mtime_ns for path in (tmp_path / "out" / "scans").iterdir()}
    assert {path: second[path] for path in first} == first
    new = sorted(path.name.split("-")[0] + path.suffix for path in set(second) - set(first))
    assert new == ["disc.exr", "disc.json", "disc.png"]

    with (tmp_path / "out" / "survey.csv").open(encoding="utf-8") as file:
        rows = {row["file"].rpartition("/")[2]: row for row in csv.DictReader(file)}
    assert set(rows) == {path.name for path in scans}
    assert list(rows)[-1] == "damaged.npy"  # failed scans come last
    light = [float(row["iridescent_light"] or 0) for row in list(rows.values())[:-1]]
    assert light == sorted(light, reverse=True)
    assert [name for name, row in rows.items() if row["reason"]] == ["damaged.npy"]
    assert float(rows["blazed.bmp"]["period_1_um"]) == pytest.approx(2.5, rel=0.01)
