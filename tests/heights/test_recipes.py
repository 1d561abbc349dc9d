"""Recipes say where heights come from and how their table is built, or what is wrong with them."""

from __future__ import annotations

import contextlib
from pathlib import Path

import numpy as np
import pytest

from mitsuba_diffraction.errors import DiffractionError, DiffractionWarning
from mitsuba_diffraction.heights import gratings
from mitsuba_diffraction.heights.field import HeightField
from mitsuba_diffraction.heights.recipes import _KEYS
from mitsuba_diffraction.heights.source import Source
from tests.support.pages import first_columns

PRECOMPUTE = Path(__file__).resolve().parent.parent.parent / "precompute"
HEIGHTS = 0.01 * np.random.default_rng(6).random((8, 9))


def write(folder, text, name="patch.toml"):
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def folder(tmp_path):
    np.save(tmp_path / "a.npy", HEIGHTS)
    np.save(tmp_path / "b.npy", HEIGHTS + 1)
    return tmp_path


SMALL_BLAZED = """generator = "blazed"
[arguments]
period = 2.0
depth = 0.2
periods = 1
rows = 4
"""


@pytest.mark.parametrize("path", sorted(PRECOMPUTE.glob("*.toml")), ids=lambda path: path.stem)
def test_recipes_of_the_project_are_valid(path):
    recipe = Source.of(path)
    assert recipe.output == path.parent / "tables" / f"{path.stem}.exr"


def test_source_is_relative_to_the_recipe(folder):
    path = write(folder, 'source = "a.npy"\npixel_size = [0.1, 0.2]\nlevel = "plane"\n')
    field = Source.of(path).field()
    assert field.pixel_size == (0.1, 0.2)
    assert "plane removed" in field.history[0]
    assert HeightField.load(path).digest() == field.digest()


def test_parameters_of_the_call_take_precedence(folder):
    path = write(folder, 'source = "a.npy"\npixel_size = 0.1\nlevel = "plane"\n')
    field = HeightField.load(path, pixel_size=0.3, level="none")
    assert field.pixel_size == (0.3, 0.3)
    assert np.array_equal(field.heights, HEIGHTS)


def test_generator_gets_its_arguments(folder):
    path = write(folder, SMALL_BLAZED)
    field = HeightField.load(path)
    assert field.digest() == gratings.blazed(2.0, 0.2, periods=1, rows=4).digest()
    opened = HeightField.load(path, periodic="open")
    assert opened.cut_out
    assert not opened.periodic


def test_a_recipe_of_an_earlier_version_loads_and_says_what_replaces_its_treatment(folder):
    for value in ("trend", "smooth", "taper", "none"):
        path = write(folder, f'periodic = "{value}"\n' + SMALL_BLAZED)
        with pytest.warns(DiffractionWarning, match="windows.*periodic=exact") as said:
            assert (
                HeightField.load(path).digest()
                == gratings.blazed(2.0, 0.2, periods=1, rows=4).digest()
            )
        assert len(said) == 1


def test_table_arguments_are_those_that_are_set(folder):
    text = """source = "a.npy"
pixel_size = 0.1
coherence_width = 30
coherence = "patch"
wavelength_range = [400, 700]
output = "out/x.exr"
"""
    recipe = Source.of(write(folder, text))
    assert recipe.settings == {
        "coherence_width": 30,
        "coherence": "patch",
        "wavelength_range": (400, 700),
    }
    assert recipe.output == folder / "out/x.exr"
    plain = Source.of(write(folder, 'source = "a.npy"'))
    assert plain.settings == {}
    assert plain.output == Path("patch.exr")  # in the current folder


def test_several_sources_are_several_patches(folder):
    source = Source.of(write(folder, 'source = ["a.npy", "b.npy"]\npixel_size = 0.1\n'))
    assert [field.name for field in source.fields()] == ["a.npy", "b.npy"]
    with pytest.raises(DiffractionError, match="2 patches"):
        source.field()


def test_seeds_are_several_patches(folder):
    text = 'generator = "elaphe_like"\nseeds = [3, 4]\n[arguments]\nextent = 8.0\npixels = 64\n'
    first, second = Source.of(write(folder, text)).fields()
    assert first.shape == second.shape == (64, 64)
    assert first.digest() != second.digest()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("# nothing", ["source", "generator"]),
        ('source = "a.npy"\ngenerator = "blazed"', ["either"]),
        ('source = "a.npy"\ncoherence_widht = 3', ["'coherence_widht'", "mean coherence_width?"]),
        ("source = 3", ["source", "3"]),
        ("source = []", ["source", "[]"]),
        ('source = ""', ["source"]),
        ('source = "patch.toml"', ["source", "is a recipe"]),
        ('source = "a.npy"\n[arguments]\nseed = 1', ["arguments"]),
        ('source = "a.npy"\nseeds = [1]', ["seeds"]),
        ('source = "a.npy"\npixel_size = 0', ["pixel_size", "0"]),
        ('source = "a.npy"\npixel_size = nan', ["pixel_size", "nan"]),
        ('source = "a.npy"\nlevel = "flat"', ["level", "'plane'"]),
        ('source = "a.npy"\ntolerance = "fine"', ["tolerance", "'fine'"]),
        ('source = "a.npy"\nterms = true', ["terms", "True"]),
        ('source = "a.npy"\nwavelength_range = [1]', ["wavelength_range"]),
        ('source = "a.npy"\noutput = "x.png"', ["output", ".exr"]),
        ('source = "a.npy"\nsource = "b.npy"', ["TOML"]),
        ('generator = "grating"', ["'grating'", "blazed"]),
        ('generator = "__all__"', ["generator"]),
        ('generator = "blazed"\npixel_size = 1', ["pixel_size"]),
        ('generator = "blazed"\n[arguments]\nperiod = 1', ["'depth'"]),
        ('generator = "blazed"\n[arguments]\npitch = 1', ["'pitch'", "period"]),
        ('generator = "blazed"\narguments = 3', ["arguments"]),
        (SMALL_BLAZED.replace("[arg", "seeds = [1]\n[arg"), ["seeds"]),
        ('generator = "elaphe_like"\nseeds = [1, 1]', ["seeds"]),
        ('generator = "elaphe_like"\nseeds = []', ["seeds"]),
        ('generator = "elaphe_like"\nseeds = [1]\n[arguments]\nseed = 2', ["seed"]),
        ("\0", ["TOML"]),
        ("a = " + "[" * 5000, ["TOML"]),
    ],
)
def test_what_does_not_fit_is_named(folder, text, words):
    with pytest.raises(DiffractionError) as caught:
        Source.of(write(folder, text))
    assert "patch.toml" in str(caught.value)
    assert "\n" not in str(caught.value)
    assert all(word in str(caught.value) for word in words)


@pytest.mark.parametrize("output", ["../x.exr", "a/../../x.exr", "/tmp/x.exr", "away/x.exr"])
def test_an_output_outside_of_the_recipe_s_folder_is_refused(folder, tmp_path_factory, output):
    with contextlib.suppress(OSError):  # Windows lets few users make links
        (folder / "away").symlink_to(tmp_path_factory.mktemp("elsewhere"))
    if (folder / "away").exists() or "away" not in output:
        with pytest.raises(DiffractionError, match="outside the file's folder"):
            Source.of(write(folder, f'source = "a.npy"\noutput = "{output}"'))


def test_what_only_the_heights_can_tell_is_named_too(folder):
    with pytest.raises(DiffractionError, match=r"none\.npy' does not exist"):
        HeightField.load(write(folder, 'source = "none.npy"'))
    with pytest.raises(DiffractionError, match="period"):
        HeightField.load(write(folder, SMALL_BLAZED.replace("2.0", "-2.0")))
    with pytest.raises(DiffractionError, match="pixel_size contradicts"):
        HeightField.load(write(folder, SMALL_BLAZED), pixel_size=0.1)


def test_files_that_are_no_recipes(tmp_path):
    (tmp_path / "a.toml").write_bytes(b"\xff\xfe")
    (tmp_path / "b.toml").write_bytes(b"#" * 2_000_000)
    (tmp_path / "c.toml").mkdir()
    for name, word in [("a", "UTF-8"), ("b", "too large"), ("c", "folder"), ("d", "not exist")]:
        with pytest.raises(DiffractionError, match=word):
            HeightField.load(tmp_path / f"{name}.toml")


def test_keys_of_recipes_are_listed():
    keys = {*_KEYS} - {"arguments"}
    assert any(names - {"arguments"} == keys for names in first_columns("docs/own-scene.md"))
