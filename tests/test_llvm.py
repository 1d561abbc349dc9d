"""The LLVM that Dr.Jit gets: found by name, tried in a child process, refused in one line."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from mitsuba_diffraction import llvm
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.llvm import choose, find, trial
from mitsuba_diffraction.llvm.find import VARIABLE, Library

HERE = [Library.at(path) for path in find.in_folders()]


def installed(version: int) -> Path:
    """The library of that version on this machine, or skip."""
    for library in HERE:
        if library.version == version:
            return library.path
    pytest.skip(f"LLVM {version} is not installed here")


@pytest.fixture(autouse=True)
def fresh(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[None]:
    """No choice made yet, nothing remembered, and Dr.Jit as if not imported."""
    monkeypatch.setenv("MITSUBA_DIFFRACTION_CACHE", str(tmp_path / "cache"))
    # set, then deleted, so that what a test chooses is undone as well
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.delenv(VARIABLE)
    monkeypatch.delitem(sys.modules, "drjit", raising=False)
    trial.tried.cache_clear()
    choose._require_loaded.cache_clear()
    yield
    trial.tried.cache_clear()
    choose._require_loaded.cache_clear()


@pytest.fixture
def no_child(monkeypatch: pytest.MonkeyPatch) -> None:
    """Starting a child process fails the test."""

    def run(*args: object, **_: object) -> None:
        raise AssertionError(f"started {args}")

    monkeypatch.setattr(subprocess, "run", run)


def only(monkeypatch: pytest.MonkeyPatch, *files: Path) -> None:
    """Make these the only libraries of the machine."""
    for module in (find, choose):
        monkeypatch.setattr(module, "in_folders", lambda: iter(files))
    monkeypatch.setattr(find, "known_to_loader", lambda: iter(()))


def python(code: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run code in a process of its own, with these environment variables on top."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**environment, **variables},
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )


# ------------------------------------------------------------------------------- finding


@pytest.mark.parametrize(
    ("path", "version"),
    [
        ("/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1", 19),
        ("/nowhere/libLLVM-19.so.1", 19),
        ("/nowhere/libLLVM-14.0.6.so.1", 14),
        ("/nowhere/libLLVM.so.21.1", 21),
        ("/nowhere/lib/libLLVM.so", None),
        ("/nowhere/lib/libLLVM.so.1", None),
        ("/nowhere/llvm-18/lib/libLLVM.so.1", 18),
        ("/nowhere/lib64/llvm17/lib/libLLVM.so", 17),
        ("/nowhere/llvm/20/lib64/libLLVM.so", 20),
        ("/opt/homebrew/Cellar/llvm/19.1.7/lib/libLLVM.dylib", 19),
        ("/opt/homebrew/Cellar/llvm@18/18.1.8/lib/libLLVM.dylib", 18),
    ],
)
def test_version_is_read_from_the_path(path: str, version: int | None):
    assert Library.at(path).version == version


def test_version_is_that_of_the_real_file_behind_a_link(tmp_path: Path):
    (tmp_path / "libLLVM-15.so.1").touch()
    (tmp_path / "libLLVM-19.so").symlink_to("libLLVM-15.so.1")
    assert Library.at(tmp_path / "libLLVM-19.so").version == 15


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="searched through the loader path")
def test_only_llvm_itself_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    names = ("libLLVM.so.23.1", "libLLVM-C.so.23", "libLLVM.so.23.1-rust-1.99.0", "libLLVMPolly.so")
    for name in names:
        (tmp_path / name).touch()
    (tmp_path / "libLLVM-24.so.1").symlink_to("dangling")
    monkeypatch.setenv("LD_LIBRARY_PATH", str(tmp_path))
    found = [library for library in llvm.find_llvm() if library.path.parent == tmp_path]
    assert found == [Library(tmp_path / "libLLVM.so.23.1", 23)]


def test_19_is_preferred_then_the_newest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    files = [tmp_path / f"libLLVM.so.{version}.1" for version in (17, 21, 19, 15, 20)]
    for file in files:
        file.touch()
    only(monkeypatch, *files)
    assert [library.version for library in llvm.find_llvm()] == [19, 21, 20, 17, 15]


def test_bare_name_is_looked_up_as_the_loader_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "libLLVM-15.so.1").touch()
    only(monkeypatch, tmp_path / "libLLVM-15.so.1")
    monkeypatch.setenv(VARIABLE, "libLLVM-15.so.1")
    assert find.named_library() == Library(tmp_path / "libLLVM-15.so.1", 15)


# ------------------------------------------------------------------------------- choosing


@pytest.mark.usefixtures("no_child")
def test_19_is_chosen_without_a_child_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for name in ("libLLVM-15.so.1", "libLLVM.so.19.1", "libLLVM.so.21.1"):
        (tmp_path / name).touch()
    only(monkeypatch, *sorted(tmp_path.glob("libLLVM*")))
    assert llvm.select_llvm() == Library(tmp_path / "libLLVM.so.19.1", 19)
    assert os.environ[VARIABLE] == str(tmp_path / "libLLVM.so.19.1")
    llvm.require_llvm()


@pytest.mark.usefixtures("no_child")
def test_choice_of_the_user_stays(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(VARIABLE, "/some/libLLVM.so")
    assert llvm.select_llvm() is None
    assert os.environ[VARIABLE] == "/some/libLLVM.so"


@pytest.mark.usefixtures("no_child")
def test_nothing_is_chosen_once_drjit_has_its_own(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "drjit", sys)
    assert llvm.select_llvm() is None
    assert VARIABLE not in os.environ


# the package as it is while its __init__ has only begun: nothing of it imported yet
BEGUN = """
import importlib.util, os, sys, time, types
package = types.ModuleType("mitsuba_diffraction")
package.__path__ = importlib.util.find_spec("mitsuba_diffraction").submodule_search_locations
sys.modules["mitsuba_diffraction"] = package
os.environ.pop("DRJIT_LIBLLVM_PATH", None)
from mitsuba_diffraction.llvm import choose, find
"""


def test_choice_takes_milliseconds():
    installed(19)
    code = f"""
{BEGUN}
times = []
for _ in range(5):
    os.environ.pop("DRJIT_LIBLLVM_PATH", None)
    start = time.perf_counter()
    choose.select_llvm()
    times.append(time.perf_counter() - start)
print(min(times), "numpy" in sys.modules, "drjit" in sys.modules)
"""
    seconds, *loaded = python(code).stdout.split()
    assert loaded == ["False", "False"]
    # 2 ms with 3000 files beside the library; ten times that for slow disks and busy machines
    assert float(seconds) < 0.03


def test_choice_after_a_trial_still_comes_before_drjit(tmp_path: Path):
    copy = tmp_path / "libLLVM.so"
    shutil.copyfile(installed(19), copy)
    code = f"""
{BEGUN}
from pathlib import Path
for module in (choose, find):
    module.in_folders = lambda: iter([Path({str(copy)!r})])
find.known_to_loader = lambda: iter(())
choose.select_llvm()
print(os.environ["DRJIT_LIBLLVM_PATH"], "drjit" in sys.modules)
"""
    assert python(code).stdout.split() == [str(copy), "False"]


# ------------------------------------------------------------------------------- trying


@pytest.mark.usefixtures("no_child")
@pytest.mark.parametrize("version", [14, 15, 16])
def test_old_versions_are_refused_untried(version: int, tmp_path: Path):
    (tmp_path / f"libLLVM-{version}.so.1").touch()
    assert not llvm.usable(tmp_path / f"libLLVM-{version}.so.1")


def test_unnamed_version_is_tried_once_and_remembered(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    copy = tmp_path / "libLLVM.so"
    shutil.copyfile(installed(19), copy)
    assert llvm.usable(copy)
    trial.tried.cache_clear()
    monkeypatch.setattr(trial, "_try", lambda path: pytest.fail("tried again"))
    assert llvm.usable(copy)


def test_unnamed_version_that_ends_the_process_is_refused(tmp_path: Path):
    copy = tmp_path / "libLLVM.so"
    shutil.copyfile(installed(15), copy)
    assert trial.tried(copy) == (15, False)
    assert not llvm.usable(copy)


@pytest.mark.parametrize("content", [b"", b"not a library"])
def test_file_that_is_no_library_is_refused(content: bytes, tmp_path: Path):
    (tmp_path / "libLLVM.so").write_bytes(content)
    assert not llvm.usable(tmp_path / "libLLVM.so")


def test_changed_file_and_broken_memory_are_tried_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    file = tmp_path / "libLLVM.so.21.1"
    file.touch()
    monkeypatch.setattr(trial, "_try", lambda path: (21, False, True))
    assert not llvm.usable(file)

    monkeypatch.setattr(trial, "_try", lambda path: (21, True, True))
    trial.tried.cache_clear()
    assert not llvm.usable(file)  # remembered
    os.utime(file, (1, 1))
    trial.tried.cache_clear()
    assert llvm.usable(file)

    (tmp_path / "cache" / "llvm.json").write_text('{"half')
    monkeypatch.setattr(trial, "_try", lambda path: (21, False, True))
    trial.tried.cache_clear()
    assert not llvm.usable(file)


def test_trial_without_an_answer_is_not_remembered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    def run(command: list[str], **_: object) -> None:
        raise subprocess.TimeoutExpired(command, 1)

    file = tmp_path / "libLLVM.so.21.1"
    file.touch()
    monkeypatch.setattr(subprocess, "run", run)
    assert not llvm.usable(file)
    assert not (tmp_path / "cache" / "llvm.json").exists()


def test_memory_that_cannot_be_written_costs_a_trial_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    (tmp_path / "file").touch()
    monkeypatch.setenv("MITSUBA_DIFFRACTION_CACHE", str(tmp_path / "file" / "cache"))
    monkeypatch.setattr(trial, "_try", lambda path: (21, True, True))
    (tmp_path / "libLLVM.so.21.1").touch()
    assert llvm.usable(tmp_path / "libLLVM.so.21.1")


# ------------------------------------------------------------------------------- requiring


@pytest.mark.parametrize("name", ["libLLVM-15.so.1", "libLLVM.so", "missing.so"])
def test_unusable_choice_of_the_user_is_one_line(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    good = tmp_path / "libLLVM.so.19.1"
    for file in ("libLLVM.so.19.1", "libLLVM-15.so.1", "libLLVM.so"):
        (tmp_path / file).touch()
    only(monkeypatch, good)
    monkeypatch.setenv(VARIABLE, str(tmp_path / name))
    with pytest.raises(DiffractionError) as caught:
        llvm.require_llvm()
    text = str(caught.value)
    assert "\n" not in text
    assert f'{VARIABLE}="{tmp_path / name}"' in text
    assert f"set it to {good}" in text


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="names Debian's package")
def test_machine_without_a_usable_llvm_is_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "libLLVM-14.so.1").touch()
    only(monkeypatch, tmp_path / "libLLVM-14.so.1")
    assert llvm.select_llvm() is None
    with pytest.raises(DiffractionError) as caught:
        llvm.require_llvm()
    text = str(caught.value)
    assert "\n" not in text
    assert f"found: 14 ({tmp_path}" in text
    assert "apt install libllvm19" in text


def test_import_of_the_package_makes_drjit_load_what_it_chose():
    installed(19)
    code = "import mitsuba_diffraction.llvm as llvm; print(*llvm.loaded_llvm_version())"
    assert python(code).stdout.startswith("19 ")


def test_drjit_that_was_imported_first_with_an_unusable_llvm_is_one_error_not_an_abort():
    code = """
import os
import drjit  # before the package, which can then only look on
del os.environ["DRJIT_LIBLLVM_PATH"]
import mitsuba_diffraction.llvm as llvm
try:
    llvm.require_llvm()
except ValueError as error:
    print(error)
"""
    done = python(code, **{VARIABLE: str(installed(15))})
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("Dr.Jit has loaded LLVM 15")
    assert "import mitsuba_diffraction before mitsuba" in done.stdout


def test_plugin_refuses_an_unusable_llvm_before_any_kernel():
    code = """
import mitsuba_diffraction
import mitsuba as mi
mi.set_variant("llvm_ad_spectral")
try:
    mi.load_dict({"type": "diffraction"})
except Exception as error:
    print(error)
"""
    done = python(code, **{VARIABLE: str(installed(15))})
    assert done.returncode == 0, done.stderr
    assert "LLVM 15 cannot compile the kernels of Dr.Jit" in done.stdout


def test_scalar_variants_need_no_llvm():
    code = """
import mitsuba_diffraction.llvm as llvm
import mitsuba as mi
mi.set_variant("scalar_spectral")
llvm.require_loaded_llvm()
print("fine")
"""
    done = python(code, **{VARIABLE: "/nowhere/libLLVM.so"})
    assert done.stdout.endswith("fine\n"), done.stderr
