"""What is published: the wheel holds all that the package reads, the sdist what the tests need."""

from __future__ import annotations

import functools
import gzip
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest
import yaml

import mitsuba_diffraction as md
from mitsuba_diffraction.plugin.presets import presets
from tests.support import ROOT

pytestmark = pytest.mark.thorough

backend = pytest.importorskip("hatchling.builders.wheel", reason="the build backend is missing")


if not (ROOT / "mitsuba_diffraction").is_dir():
    pytest.skip("the package's source is not here", allow_module_level=True)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """The wheel, as `pip wheel .` makes it."""
    folder = tmp_path_factory.mktemp("wheel")
    return Path(next(backend.WheelBuilder(str(ROOT)).build(directory=str(folder))))


@pytest.fixture(scope="module")
def in_wheel(wheel) -> set[str]:
    """Names of the wheel's files."""
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


@pytest.fixture(scope="module")
def in_sdist(tmp_path_factory) -> set[str]:
    """Names of the sdist's files, beneath its one folder."""
    from hatchling.builders.sdist import SdistBuilder

    folder = tmp_path_factory.mktemp("sdist")
    with pytest.MonkeyPatch.context() as patch:
        # the same files, packed in a tenth of the time
        patch.setattr(gzip, "GzipFile", functools.partial(gzip.GzipFile, compresslevel=0))
        path = next(SdistBuilder(str(ROOT)).build(directory=str(folder)))
    with tarfile.open(path) as archive:
        names = [member.name for member in archive if member.isfile()]
    tops = {name.partition("/")[0] for name in names}
    assert tops == {f"mitsuba_diffraction-{md.__version__}"}
    return {name.partition("/")[2] for name in names}


def tracked(folder: str) -> set[str]:
    """Files of a folder, without what Python leaves there."""
    return {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / folder).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }


def test_the_wheel_holds_the_whole_package(in_wheel):
    package = tracked("mitsuba_diffraction")
    assert package <= in_wheel
    assert "mitsuba_diffraction/py.typed" in package
    for needed in ("realtime/glsl/shaders/*.glsl", "realtime/web/page/*"):
        assert list((ROOT / "mitsuba_diffraction").glob(needed)), needed


def test_the_wheel_holds_nothing_else(in_wheel):
    info = f"mitsuba_diffraction-{md.__version__}.dist-info/"
    others = {name for name in in_wheel if not name.startswith(info)}
    # `render MESH` works without a clone
    scenes = ("own_mesh", "studio", "lamp", "outdoors", "daylight", "environment", "label", "ring")
    studio = {f"mitsuba_diffraction/scene/studio/{n}.xml" for n in scenes}
    brought = studio | {
        f"mitsuba_diffraction/plugin/patches/{look.patch.relative_to(ROOT / 'precompute')}"
        for look in presets().values()
    }
    assert brought <= others
    assert others <= tracked("mitsuba_diffraction") | brought | {"_mitsuba_diffraction.py"}


def test_the_wheel_declares_command_and_plugin(wheel):
    with zipfile.ZipFile(wheel) as archive:
        name = f"mitsuba_diffraction-{md.__version__}.dist-info/"
        entry_points = archive.read(f"{name}entry_points.txt").decode()
        metadata = archive.read(f"{name}METADATA").decode()
    assert "mitsuba-diffraction = _mitsuba_diffraction:main" in entry_points
    assert "mitsuba_diffraction = mitsuba_diffraction.plugin.registration" in entry_points
    assert f"\nVersion: {md.__version__}\n" in metadata
    for extra in ("afm", "gl", "notebooks"):
        assert f"\nProvides-Extra: {extra}\n" in metadata


def test_the_wheel_imports_and_answers_from_elsewhere(wheel, tmp_path):
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path)
    code = (
        "import sys; sys.path.insert(0, '.')\n"
        "import mitsuba_diffraction.cli; mitsuba_diffraction.glsl.export_shader\n"
        "assert mitsuba_diffraction.cli.__file__.startswith(sys.argv[1])\n"
        "import _mitsuba_diffraction; sys.argv[1:] = ['--version']\n"
        "sys.exit(_mitsuba_diffraction.main())"
    )
    ran = subprocess.run(
        [sys.executable, "-I", "-c", code, str(tmp_path)],
        cwd=tmp_path, capture_output=True, text=True, timeout=300,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    assert md.__version__ in ran.stdout


def test_the_sdist_holds_what_the_tests_need(in_sdist):
    made = {name for name in tracked("precompute") if name.startswith("precompute/tables/")}
    for folder in ("mitsuba_diffraction", "scenes", "precompute", "tests", "docs", "notebooks"):
        needed = tracked(folder) - made
        assert needed, folder
        assert {n for n in needed - in_sdist if ".ipynb_checkpoints" not in n} == set()
    assert {
        "README.md",
        "CHANGELOG.md",
        "LICENSE",
        "CITATION.cff",
        "Makefile",
        ".ci/setup",
    } <= in_sdist


def test_the_sdist_holds_nothing_made(in_sdist):
    assert not {n for n in in_sdist if n.startswith((".venv/", "out/", "precompute/tables/"))}
    assert not {n for n in in_sdist if n.endswith(".pyc") or n.startswith(".git/")}


def test_version_is_that_of_changelog_citation_and_tag():
    with (ROOT / "pyproject.toml").open("rb") as file:
        version = tomllib.load(file)["project"]["version"]
    assert md.__version__ == version
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == version
    headings = re.findall(r"^## (\d\S*)", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert headings[:1] in ([], [version])  # none before the first release
    if shutil.which("git") and (ROOT / ".git").exists():
        words = ["git", "tag", "--points-at", "HEAD", "v*"]
        tags = subprocess.run(words, cwd=ROOT, capture_output=True, text=True).stdout.split()
        assert tags == [f"v{heading}" for heading in headings[:1]] or not tags


def test_everything_public_is_there():
    for name in md.__all__:
        assert getattr(md, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'moths'"):
        md.moths  # noqa: B018


def test_what_renders_do_without_is_imported_on_demand():
    code = (
        "import sys, mitsuba_diffraction as md\n"
        "slow = {'mitsuba', 'drjit', 'matplotlib', 'scipy.signal'}\n"
        "assert not {*slow, 'mitsuba_diffraction.realtime'} & set(sys.modules)\n"
        "assert md.maps.brdf_map and md.period_fit.Beam and md.glsl.Renderer and md.web.Viewer"
    )
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert ran.returncode == 0, ran.stderr
