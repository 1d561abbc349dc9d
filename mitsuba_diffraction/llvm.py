"""An LLVM that Dr.Jit survives, chosen before Dr.Jit loads one.

Dr.Jit 1.5 loads LLVM while `drjit` is imported, and keeps it: the file that DRJIT_LIBLLVM_PATH
names, else the loader's `libLLVM.so`, else the highest-numbered libLLVM*.so.* of the system's
library folder. On macOS it knows Homebrew's `llvm`, but not `llvm@19`. It refuses version 14 and
older itself; 15 and 16 load, and end the whole process at the first kernel with a minimum or
maximum ("Cannot select ... fminimum"). So the choice is made here, on import of the package
(`select_llvm`), and later use checks the loaded library (`require_llvm`, `require_loaded_llvm`).
"""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

from .errors import DiffractionError

#: Environment variable that names the LLVM library for Dr.Jit.
VARIABLE = "DRJIT_LIBLLVM_PATH"

#: The first whose x86 backend compiles Dr.Jit's minimum and maximum (tried: not 14, 15 or 16).
OLDEST = 17
#: Version that the tests run on, hence the first choice; kernels are tested on all other versions.
TESTED = 19

# libLLVM-19.so.1, libLLVM.so.19.1, libLLVM-14.0.6.so.1, libLLVM.dylib; not libLLVM-C.dylib,
# libLLVMPolly.so or the private libLLVM.so.19.1-rust-1.86.0
_FILE = re.compile(r"libLLVM(-\d+(\.\d+)*)?(\.so(\.\d+)*|(\.\d+)*\.dylib)|LLVM-C\.dll", re.I)
_VERSION_IN_NAME = re.compile(r"libLLVM(?:-|\.so\.|\.)(\d\d)(?!\d)", re.I)
# /usr/lib/llvm-19/lib, /opt/homebrew/Cellar/llvm@19/19.1.7/lib, /usr/lib64/llvm19/lib
_VERSION_IN_FOLDER = re.compile(r"/llvm(?:@\d+/|[-@/])?(\d\d)[./]", re.I)


def version_of(path: Path) -> int | None:
    """Return the major version of LLVM by the path of its library; None if it does not tell.

    Links are followed, since only the real file's name is telling.
    """
    real = path.resolve()
    version = _VERSION_IN_NAME.match(real.name) or _VERSION_IN_FOLDER.search(real.as_posix())
    return int(version[1]) if version else None


def find_llvm() -> list[Path]:
    """Return all libraries, the one to prefer first: 19, the newest, then unknown versions."""
    named = named_library()
    files = [*([named] if named else []), *in_folders()]
    return sorted(
        {file.resolve() for file in files if file.is_file()},
        key=lambda file: (version_of(file) != TESTED, -(version_of(file) or 0), str(file)),
    )


def named_library() -> Path | None:
    """Library that the environment variable names; the loader finds a bare file name."""
    value = os.environ.get(VARIABLE)
    if not value:
        return None
    path = Path(value)
    found = [] if path.is_file() else [file for file in in_folders() if file.name == value]
    return (found[0] if found else path).resolve()


def in_folders(
    system: str = sys.platform,
    machine: str = platform.machine(),
    environment: Mapping[str, str] = os.environ,
    root: Path = Path("/"),
) -> Iterator[Path]:
    """Yield the libraries where systems and package managers put them, within milliseconds.

    Parameters
    ----------
    system, machine : as in `sys.platform` and `platform.machine()`.
    environment : environment variables.
    root : folder that stands for the root of the file system; not on Windows.
    """
    prefix = Path(sys.prefix)  # conda installs LLVM beside Python
    if system == "win32":
        programs = environment.get("PROGRAMFILES", r"C:\Program Files")
        folders = [prefix / "Library" / "bin", Path(programs) / "LLVM" / "bin"]
        searched = environment.get("PATH", "").split(";")
    elif system == "darwin":
        # Homebrew on Apple silicon, MacPorts, Homebrew on Intel
        patterns = (
            "opt/homebrew/opt/llvm*/lib", "opt/local/libexec/llvm-*/lib", "usr/local/opt/llvm*/lib"
        )  # fmt: skip
        folders = [prefix / "lib", *(found for each in patterns for found in root.glob(each))]
        searched = environment.get("DYLD_LIBRARY_PATH", "").split(":")
    else:
        usr = root / "usr"
        folders = [prefix / "lib", usr / "lib" / f"{machine}-linux-gnu", usr / "lib64", usr / "lib"]
        for pattern in ("lib/llvm-*/lib", "lib64/llvm*/lib", "lib/llvm/*/lib64"):
            folders += usr.glob(pattern)
        folders.append(usr / "local" / "lib")
        searched = environment.get("LD_LIBRARY_PATH", "").split(":")
    for folder in [*folders, *(Path(name) for name in searched if name)]:
        try:
            entries = list(os.scandir(folder))
        except OSError:
            continue  # most systems have only a few of these folders
        yield from (Path(entry.path) for entry in entries if _FILE.fullmatch(entry.name))


def select_llvm() -> Path | None:
    """Point DRJIT_LIBLLVM_PATH to the best library, unless it is set or it is too late.

    Returns the choice. Without an LLVM there is no message: other backends do without, and
    `require_llvm` has the words.
    """
    if "drjit" in sys.modules or os.environ.get(VARIABLE):
        return None
    library = _best()
    if library is not None:
        os.environ[VARIABLE] = str(library)
    return library


def loaded_llvm_version() -> tuple[int, int, int] | None:
    """(major, minor, patch) of the LLVM that Dr.Jit runs on; None if it has none, or none yet."""
    if "drjit" not in sys.modules:
        return None
    from drjit.detail import llvm_version

    major, minor, patch = llvm_version()
    return (major, minor, patch) if major > 0 else None


def require_llvm() -> None:
    """Make sure that this process can compile with LLVM.

    Raises a DiffractionError if it cannot, with the versions found, the versions supported, and how
    to install one.
    """
    version, loaded = loaded_llvm_version(), "drjit" in sys.modules
    if version is not None and version[0] >= OLDEST:
        return
    named, best = named_library(), _best()
    if named is not None and (version is None or version_of(named) in (None, version[0])):
        fault = _too_old(version[0]) if version else _fault_of(named)
        if loaded or fault:
            other = _best(apart_from=named)
            remedy = f"set it to {other}, or unset it" if other else f"unset it, and {_install()}"
            raise DiffractionError(
                f'{VARIABLE}="{os.environ[VARIABLE]}": {fault or "Dr.Jit cannot load it"}; {remedy}'
            )
    elif best is None:
        found = [f"{version_of(file) or 'unknown version'} ({file})" for file in find_llvm()]
        raise DiffractionError(
            f"there is no LLVM that Dr.Jit can use; found: {', '.join(found) or 'none'}; usable: "
            f"{OLDEST} or newer, best {TESTED}; {_install()}"
        )
    elif loaded:
        number = ".".join(map(str, version or ()))
        what = (
            "found no LLVM"
            if version is None
            else f"loaded LLVM {number}, which would end the process"
        )
        raise DiffractionError(
            f"Dr.Jit has {what}; import mitsuba_diffraction before mitsuba and drjit, or start "
            f"again with {VARIABLE}={best}"
        )


def require_loaded_llvm() -> None:
    """Call `require_llvm` if Mitsuba's current variant compiles with LLVM."""
    import mitsuba as mi

    if (mi.variant() or "").startswith("llvm"):
        require_llvm()


def _best(apart_from: Path | None = None) -> Path | None:
    libraries = (library for library in find_llvm() if library != apart_from)
    return next((library for library in libraries if _fault_of(library) is None), None)


def _fault_of(library: Path) -> str | None:
    """Why Dr.Jit cannot work with it, as a clause, or None; a version untold may do."""
    if not library.is_file():
        return "there is no such file"
    version = version_of(library)
    return _too_old(version) if version is not None and version < OLDEST else None


def _too_old(version: int) -> str:
    return f"LLVM {version} cannot compile the kernels of Dr.Jit"


def _install() -> str:
    if sys.platform == "darwin":
        return f"brew install llvm@{TESTED}"
    if sys.platform == "win32":
        return f"winget install LLVM.LLVM --version {TESTED}.1.7, or set {VARIABLE}"
    return f"apt install libllvm{TESTED}, or set {VARIABLE} to one elsewhere"
