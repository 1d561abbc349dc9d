"""Which LLVM there are: found by name, where the loader looks."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from mitsuba_diffraction import llvm
from mitsuba_diffraction.llvm import VARIABLE, version_of
from tests.support.machine import only


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
    assert version_of(Path(path)) == version


def test_version_is_that_of_the_real_file_behind_a_link(tmp_path: Path):
    (tmp_path / "libLLVM-15.so.1").touch()
    (tmp_path / "libLLVM-19.so").symlink_to("libLLVM-15.so.1")
    assert version_of(tmp_path / "libLLVM-19.so") == 15


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="searched through the loader path")
def test_only_llvm_itself_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    names = ("libLLVM.so.23.1", "libLLVM-C.so.23", "libLLVM.so.23.1-rust-1.99.0", "libLLVMPolly.so")
    for name in names:
        (tmp_path / name).touch()
    (tmp_path / "libLLVM-24.so.1").symlink_to("dangling")
    monkeypatch.setenv("LD_LIBRARY_PATH", str(tmp_path))
    found = [library for library in llvm.find_llvm() if library.parent == tmp_path]
    assert found == [tmp_path / "libLLVM.so.23.1"]


def test_19_is_preferred_then_the_newest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    files = [tmp_path / f"libLLVM.so.{version}.1" for version in (17, 21, 19, 15, 20)]
    for file in files:
        file.touch()
    only(monkeypatch, *files)
    assert [version_of(library) for library in llvm.find_llvm()] == [19, 21, 20, 17, 15]


def test_bare_name_is_looked_up_as_the_loader_does(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    (tmp_path / "libLLVM-15.so.1").touch()
    only(monkeypatch, tmp_path / "libLLVM-15.so.1")
    monkeypatch.setenv(VARIABLE, "libLLVM-15.so.1")
    assert llvm.named_library() == tmp_path / "libLLVM-15.so.1"


def touched(file: Path) -> Path:
    """An empty file, in folders made for it."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.touch()
    return file


def found(root: Path, system: str, machine: str = "", **environment: str) -> set[Path]:
    """The libraries beneath a folder, found as a system of this name would."""
    everywhere = llvm.in_folders(system, machine, environment, root)
    return {file.resolve() for file in everywhere if file.is_relative_to(root)}


def test_homebrew_keeps_versions_beside_each_other(tmp_path: Path):
    brew = tmp_path / "opt/homebrew"
    for name, version in (("llvm", "21.1.0"), ("llvm@19", "19.1.7")):
        cellar = touched(brew / "Cellar" / name / version / "lib/libLLVM.dylib").parents[1]
        touched(cellar / "lib/libLLVM-C.dylib")
        (brew / "opt").mkdir(exist_ok=True)
        (brew / "opt" / name).symlink_to(cellar)
    versions = {version_of(file) for file in found(tmp_path, "darwin")}
    assert versions == {19, 21}


@pytest.mark.parametrize("machine", ["x86_64", "aarch64"])
def test_debian_has_a_folder_for_each_architecture(tmp_path: Path, machine: str):
    lib = tmp_path / "usr/lib"
    files = {
        name: touched(lib / f"{name}-linux-gnu/libLLVM.so.19.1") for name in ("x86_64", "aarch64")
    }
    assert found(tmp_path, "linux", machine) == {files[machine]}


def test_windows_has_it_among_programs_or_on_the_path(tmp_path: Path):
    installed = touched(tmp_path / "Program Files/LLVM/bin/LLVM-C.dll")
    other = touched(tmp_path / "other/LLVM-C.dll")
    programs = str(tmp_path / "Program Files")
    path = f"{tmp_path / 'nothing'};{other.parent}"
    assert found(tmp_path, "win32", PROGRAMFILES=programs, PATH=path) == {installed, other}
