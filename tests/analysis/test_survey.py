"""Surveys: rows tell what a scan is, a bad file is a row, and a second run does what is new."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitsuba_diffraction import DiffractionError, DiffractionTable, HeightField, gratings
from mitsuba_diffraction.analysis import survey as module
from mitsuba_diffraction.analysis.iridescence import light_and_chance
from mitsuba_diffraction.analysis.maps.result import LightDirection
from mitsuba_diffraction.analysis.repeats import sample_of, scan_files, write_repeats
from mitsuba_diffraction.analysis.survey import ranked, run_survey
from mitsuba_diffraction.analysis.treatments import Treatment, load_treatments
from mitsuba_diffraction.cluster.tasks import MissingFiles, SceneFiles
from tests.analysis.perfect import perfect
from tests.support.directions import rough_patch

pytestmark = pytest.mark.thorough

PERIOD, PIXEL = 1.6, 0.1
SMALL = {"coherence_width": 6.0, "tolerance": 0.05}


@pytest.fixture
def scans(tmp_path):
    """A grating across x, one turned by 30°, and a file that is none."""
    n = 128
    x, y = PIXEL * np.arange(n), PIXEL * np.arange(n)[:, None]
    turn = math.radians(30)
    for name, phase in (("straight", x + 0 * y), ("turned", x * np.cos(turn) + y * np.sin(turn))):
        np.save(tmp_path / f"{name}.npy", 0.03 * np.sin(2 * np.pi * phase / PERIOD))
    (tmp_path / "broken.npy").write_bytes(b"\x93NUMPY and no more")
    return [tmp_path / f"{name}.npy" for name in ("straight", "broken", "turned")]


@pytest.fixture
def survey(scans, tmp_path):
    text = f'["*.npy"]\npixel_size = {PIXEL}\n'
    treatment = load_treatments(_toml(tmp_path, text), Treatment(settings=SMALL))

    def call(files=scans, **more):
        out = tmp_path / "out"
        return run_survey(files, out, treatment=treatment, resolution=32, theta=20.0, **more)

    return call


def _toml(folder, text):
    path = folder / "treatments.toml"
    path.write_text(text, "utf-8")
    return path


def test_rows_have_periods_to_a_percent_and_a_second_run_measures_only_what_is_new(
    survey, scans, tmp_path, monkeypatch
):
    first = straight, broken, turned = survey()
    assert broken["reason"].startswith("'")
    assert "NPY" in broken["reason"]
    for row, direction in ((straight, 0.0), (turned, 30.0)):
        assert row["reason"] == ""
        assert row["period_1_um"] == pytest.approx(PERIOD, rel=0.01)
        assert row["direction_1_deg"] == pytest.approx(direction, abs=1.0)
        assert row["share_1"] > 0.9
        assert row["iridescence"] > 0.02
        shares = [v for k, v in row.items() if k.startswith("share_") and not k[-1].isdigit()]
        assert sum(shares) == pytest.approx(1.0)
        with Image.open(tmp_path / "out" / row["map"]) as picture:
            assert picture.size == (32, 32)
    with (tmp_path / "out" / "survey.csv").open(encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    names = [Path(row["file"]).stem for row in table]
    assert (set(names[:2]), names[2]) == ({"straight", "turned"}, "broken")
    periods = {float(row["period_1_um"]) for row in table[:2]}
    assert periods == {straight["period_1_um"], turned["period_1_um"]}
    assert (tmp_path / "out" / "sheet.png").is_file()

    measured, measure = [], module.measure

    def counted(job, contents=None):
        measured.append(job.files.scene)
        return measure(job, contents)

    monkeypatch.setattr(module, "measure", counted)
    assert survey() == [*first]
    assert measured == []
    np.save(scans[2], np.load(scans[2]) * 0.5)
    assert survey()[2]["range_um"] == pytest.approx(0.5 * turned["range_um"])
    assert measured == [str(scans[2])]


def test_a_table_that_cannot_be_mapped_is_a_row_with_its_reason(scans, tmp_path):
    own = Treatment(settings={**SMALL, "wavelength_range": (500.0, 600.0)})
    treatment = load_treatments(_toml(tmp_path, f'["*.npy"]\npixel_size = {PIXEL}\n'), own)
    (row,) = run_survey(scans[:1], tmp_path / "out", treatment=treatment, resolution=8)
    assert "starts at 500 nm" in row["reason"]


def test_treatments_are_those_of_all_patterns_that_match(tmp_path):
    path = _toml(
        tmp_path,
        '["*.png"]\npixel_size = 0.1\nlevel = "plane"\n["b*"]\nlevel = "lines"\ntolerance = 0.1\n',
    )
    treatment = load_treatments(path)
    found = treatment(Path("in/b.png"))
    assert found.options.pixel_size == (0.1, 0.1)
    assert found.options.level == "lines"
    assert found.settings == {"tolerance": 0.1}
    assert treatment(Path("in/c.npy")) == Treatment()


def test_scans_are_files_folders_and_patterns(tmp_path):
    for name in ("b_1.npy", "b_2.npy", "a.txt", "notes.md", ".hidden.npy"):
        (tmp_path / name).touch()
    (tmp_path / "empty").mkdir()
    listed = scan_files([tmp_path / "b_*.npy", tmp_path, tmp_path / "missing.npy"])
    assert [file.name for file in listed] == ["b_1.npy", "b_2.npy", "a.txt", "missing.npy"]
    for nothing in (tmp_path / "empty", tmp_path / "*.spm", tmp_path / "missing.npy"):
        with pytest.raises(DiffractionError, match=re.escape(str(nothing))):
            scan_files([nothing])


@pytest.mark.parametrize(
    ("name", "sample"),
    [("s/scale_1.spm", "s/scale"), ("s/scale-02.spm", "s/scale"), ("s/scale.003", "s/scale"),
     ("s/scale (4).spm", "s/scale"), ("s/65um.png", "s/65um"), ("s/7.spm", "s")],
)  # fmt: skip
def test_repeated_scans_have_names_with_a_number(name, sample):
    assert sample_of(Path(name)) == str(Path(sample))
    assert sample_of(Path(name), "folder") == "s"


def test_samples_have_means_and_standard_errors(tmp_path):
    rows = [{"sample": "a", "reason": "", "iridescence": i} for i in (0.1, 0.2, 0.3)]
    rows += [{"sample": "a", "reason": "damaged"}, {"sample": "b", "reason": "", "range_um": 2.0}]
    first, second = write_repeats(tmp_path / "samples.csv", rows)
    assert (first["scans"], first["failed"]) == (3, 1)
    assert first["iridescence"] == pytest.approx(0.2)
    assert first["iridescence_se"] == pytest.approx(0.1 / math.sqrt(3))
    assert second["range_um"] == 2.0
    assert "range_um_se" not in second
    with (tmp_path / "samples.csv").open(encoding="utf-8") as file:
        assert [row["sample"] for row in csv.DictReader(file)] == ["a", "b"]


def test_an_interrupted_survey_has_the_rows_that_are_done(survey, tmp_path):
    said = []

    def interrupt(done, total, text):
        said.append(text)
        if done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        survey(progress=interrupt)
    with (tmp_path / "out" / "survey.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [Path(row["file"]).stem for row in rows] == ["straight"]
    assert said == ["straight.npy", "broken.npy"]


def test_rows_are_ranked_by_light_beyond_chance_and_failed_ones_last():
    rows = [
        {"file": "failed", "reason": "no heights"},
        {"file": "narrow", "reason": "", "iridescent_light": 0.9, "ranked_among": "scans below 10"},
        {"file": "chance", "reason": "", "iridescent_light": "", "ranked_among": "scans from 10"},
        {"file": "faint", "reason": "", "iridescent_light": 1e-4, "ranked_among": "scans from 10"},
        {"file": "bright", "reason": "", "iridescent_light": 0.1, "ranked_among": "scans from 10"},
    ]
    assert [r["file"] for r in ranked(rows)] == ["bright", "faint", "chance", "narrow", "failed"]


def test_chance_explains_an_unordered_surface_and_not_a_grating():
    n = 128
    rough = rough_patch((n, n), (0.08, 0.08), 0.01)
    x = 0.08 * np.arange(n)
    grating = HeightField(0.3 * rough.heights + 0.03 * np.sin(2 * np.pi * x / 1.28), 0.08)
    light = LightDirection(30.0, 0.0)
    for field, above in ((rough, 1.25), (grating, 1.3)):
        table = DiffractionTable.build(field, coherence_width=10.0, tolerance=0.01)
        diffracted, chance = light_and_chance(table, light, perfect(light))
        index = diffracted.iridescence()
        # chance differs by some 10 % from patch to patch
        assert (index > above * chance) == (field is grating), (index, chance)


def test_a_grating_ranks_alike_at_any_angle_and_number_of_periods():
    x = 0.08 * np.arange(128)
    ranks = []
    for periods, turn in ((10.0, 0.0), (10.5, 0.0), (10.5, 1.0), (10.3, 30.0), (10.5, 45.0)):
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        waves = np.sin(2 * np.pi * periods / 10.24 * (c * x + s * x[:, None]))
        field = HeightField(0.015 * waves, 0.08, cut_out=True)
        table = DiffractionTable.build(field, tolerance=0.01)
        light = LightDirection(30.0, turn)
        diffracted, chance = light_and_chance(table, light, perfect(light))
        index = diffracted.iridescence()
        # a grating's own leakage around its lobes is no unordered surface
        assert chance < 0.1 * index, (periods, turn)
        ranks.append(np.sqrt(index**2 - chance**2) * diffracted.share)
    # periods differ by 5 %, and windows see gratings at other phases
    assert np.ptp(ranks) < 0.1 * np.mean(ranks), ranks


def test_scans_of_different_sizes_are_measured_on_crops_of_one(survey, tmp_path):
    field = gratings.elaphe_like(25.0, 250)
    for name, pixels in (("wide", 250), ("narrow", 80)):
        np.save(tmp_path / f"{name}.npy", field.heights[:pixels, :pixels])
    rows = survey([tmp_path / "wide.npy", tmp_path / "narrow.npy"], crops=3)
    assert [row.get("crop", "") for row in rows] == [1, 2, 3, ""]
    assert [row["width_um"] for row in rows] == pytest.approx([10.0, 10.0, 10.0, 8.0])
    assert len({row["range_um"] for row in rows[:3]}) == 3
    with (tmp_path / "out" / "samples.csv").open(encoding="utf-8") as file:
        wide, narrow = csv.DictReader(file)
    assert float(wide["range_um_se"]) > 0.0
    assert narrow["range_um_se"] == ""


def test_a_file_that_changed_since_the_survey_began_is_a_row(tmp_path):
    """A worker asks for its content once, not again and again."""
    file = tmp_path / "scan.npy"
    np.save(file, np.zeros((16, 16)))
    digests = SceneFiles.from_scene(file, {})
    job = module.Job(digests, Treatment(), 30.0, 16, "llvm_ad_spectral", 1)
    file.write_bytes(b"of another scan")
    with pytest.raises(MissingFiles) as missing:
        module.measure(job)
    (digest,) = missing.value.digests
    row = module.measure(job, {digest: file.read_bytes()}).row
    assert row["reason"] == "its files changed since the command began; run it again"
