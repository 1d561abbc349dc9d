"""The LLVM that Dr.Jit gets: chosen before it loads one, refused in one line."""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

from mitsuba_diffraction import llvm
from mitsuba_diffraction.errors import DiffractionError
from mitsuba_diffraction.llvm import VARIABLE
from tests.support.machine import installed, only, python


def test_19_is_chosen_before_newer_ones(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    for name in ("libLLVM-15.so.1", "libLLVM.so.19.1", "libLLVM.so.21.1"):
        (tmp_path / name).touch()
    only(monkeypatch, *sorted(tmp_path.glob("libLLVM*")))
    assert llvm.select_llvm() == tmp_path / "libLLVM.so.19.1"
    assert os.environ[VARIABLE] == str(tmp_path / "libLLVM.so.19.1")
    llvm.require_llvm()


def test_choice_of_the_user_stays(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv(VARIABLE, "/some/libLLVM.so")
    assert llvm.select_llvm() is None
    assert os.environ[VARIABLE] == "/some/libLLVM.so"


def test_nothing_is_chosen_once_drjit_has_its_own(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(sys.modules, "drjit", sys)
    assert llvm.select_llvm() is None
    assert VARIABLE not in os.environ


# the package as it is while its __init__ has only begun: nothing of it imported yet
BEGUN = """
import importlib.util, os, sys, types
package = types.ModuleType("mitsuba_diffraction")
package.__path__ = importlib.util.find_spec("mitsuba_diffraction").submodule_search_locations
sys.modules["mitsuba_diffraction"] = package
os.environ.pop("DRJIT_LIBLLVM_PATH", None)
from mitsuba_diffraction import llvm
"""


def test_choice_goes_by_names_alone():
    """It takes milliseconds at every import: no process is started, nothing loaded or read."""
    installed(19)
    code = f"""
{BEGUN}
events = []
sys.addaudithook(lambda event, _: events.append(event))
assert llvm.select_llvm() is not None
print(*{{"numpy", "drjit", "subprocess"}} & set(sys.modules))
print(*set(events) & {{"ctypes.dlopen", "open", "os.fork", "os.posix_spawn", "subprocess.Popen"}})
"""
    assert python(code).stdout == "\n\n"


@pytest.mark.parametrize("name", ["libLLVM-15.so.1", "missing.so"])
def test_unusable_choice_of_the_user_is_one_line(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    good = tmp_path / "libLLVM.so.19.1"
    for file in ("libLLVM.so.19.1", "libLLVM-15.so.1"):
        (tmp_path / file).touch()
    only(monkeypatch, good)
    monkeypatch.setenv(VARIABLE, str(tmp_path / name))
    with pytest.raises(DiffractionError) as caught:
        llvm.require_llvm()
    text = str(caught.value)
    assert "\n" not in text
    assert f'{VARIABLE}="{tmp_path / name}"' in text
    assert f"set it to {good}" in text


def test_file_that_is_no_library_is_one_line(tmp_path: Path):
    (tmp_path / "libLLVM.so").write_bytes(b"not a library")
    # once in some hundred runs Dr.Jit 1.5 never ends after it failed to load a library
    code = """
import os
import mitsuba_diffraction.llvm as llvm
import drjit  # which loads its library
try:
    llvm.require_llvm()
except ValueError as error:
    print(error, flush=True)
os._exit(0)
"""
    done = python(code, **{VARIABLE: str(tmp_path / "libLLVM.so")})
    assert "Dr.Jit cannot load it" in done.stdout, done.stderr


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
    code = "import mitsuba_diffraction.llvm as llvm, mitsuba; print(*llvm.loaded_llvm_version())"
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
