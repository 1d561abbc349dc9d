"""The LLVM libraries of this machine, and their versions as far as file names tell."""

from __future__ import annotations

import os
import platform
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

#: Environment variable through which Dr.Jit is told what to load.
VARIABLE = "DRJIT_LIBLLVM_PATH"

#: The first whose x86 backend compiles Dr.Jit's minimum and maximum (tried: not 14, 15 or 16).
OLDEST = 17
#: What the tests run on, and so the first choice; they run kernels on every other that there is.
TESTED = 19

# libLLVM-19.so.1, libLLVM.so.19.1, libLLVM-14.0.6.so.1, libLLVM.dylib; not libLLVM-C.dylib,
# libLLVMPolly.so or the private libLLVM.so.19.1-rust-1.86.0
_FILE = re.compile(r"libLLVM(-\d+(\.\d+)*)?(\.so(\.\d+)*|(\.\d+)*\.dylib)|LLVM-C\.dll", re.I)
_VERSION_IN_NAME = re.compile(r"libLLVM(?:-|\.so\.|\.)(\d\d)(?!\d)", re.I)
# /usr/lib/llvm-19/lib, /opt/homebrew/Cellar/llvm@19/19.1.7/lib, /usr/lib64/llvm19/lib
_VERSION_IN_FOLDER = re.compile(r"/llvm(?:@\d+/|[-@/])?(\d\d)[./]", re.I)


@dataclass(frozen=True)
class Library:
    """A shared library of LLVM; `version` is its major version, None if its path does not tell."""

    path: Path
    version: int | None

    @classmethod
    def at(cls, path: str | os.PathLike[str]) -> Library:
        """The library at `path`, links followed, since only the real file's name is telling."""
        real = Path(path).resolve()
        found = _VERSION_IN_NAME.match(real.name) or _VERSION_IN_FOLDER.search(real.as_posix())
        return cls(real, int(found[1]) if found else None)

    def __str__(self) -> str:
        return f"{self.version or 'unknown version'} ({self.path})"


def find_llvm() -> list[Library]:
    """All of them, the one to prefer first: 19, then the newest, then those of no known version."""
    named = named_library()
    files = [*([named.path] if named else []), *in_folders()]
    return sorted({Library.at(file) for file in files if file.is_file()}, key=_preference)


def named_library() -> Library | None:
    """What the environment variable names; a bare file name is the loader's to find."""
    value = os.environ.get(VARIABLE)
    if not value:
        return None
    if Path(value).name == value and not Path(value).is_file():
        for file in in_folders():
            if file.name == value:
                return Library.at(file)
    return Library.at(value)


def _preference(library: Library) -> tuple[bool, int, str]:
    return library.version != TESTED, -(library.version or 0), str(library.path)


def in_folders() -> Iterator[Path]:
    """Libraries where systems and package managers put them; takes a few milliseconds."""
    for folder in _folders():
        try:
            entries = list(os.scandir(folder))
        except OSError:
            continue  # most systems have only a few of these folders
        yield from (Path(entry.path) for entry in entries if _FILE.fullmatch(entry.name))


def _folders() -> Iterator[Path]:
    """Folders with libraries for this process's architecture."""
    prefix = Path(sys.prefix)  # conda installs LLVM beside Python
    if sys.platform == "win32":
        programs = os.environ.get("PROGRAMFILES", r"C:\Program Files")
        yield from (prefix / "Library" / "bin", Path(programs) / "LLVM" / "bin")
        searched = os.environ.get("PATH", "")
    elif sys.platform == "darwin":
        yield prefix / "lib"
        for pattern in ("homebrew/opt/llvm*/lib", "local/libexec/llvm-*/lib"):
            yield from Path("/opt").glob(pattern)
        yield from Path("/usr/local/opt").glob("llvm*/lib")
        searched = os.environ.get("DYLD_LIBRARY_PATH", "")
    else:
        yield prefix / "lib"
        usr = Path("/usr")
        yield from (usr / "lib" / f"{platform.machine()}-linux-gnu", usr / "lib64", usr / "lib")
        for pattern in ("lib/llvm-*/lib", "lib64/llvm*/lib", "lib/llvm/*/lib64"):
            yield from usr.glob(pattern)
        yield usr / "local" / "lib"
        searched = os.environ.get("LD_LIBRARY_PATH", "")
    yield from (Path(folder) for folder in searched.split(os.pathsep) if folder)
