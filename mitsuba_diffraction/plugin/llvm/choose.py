"""Naming an LLVM to Dr.Jit in time, and saying in one line why none will do."""

from __future__ import annotations

import functools
import os
import sys

from ...errors import DiffractionError
from .find import TRUSTED, VARIABLE, Library, find_llvm, in_folders, named_library
from .trial import OLDEST, fault_of, tried


def select_llvm() -> Library | None:
    """Point DRJIT_LIBLLVM_PATH to the best usable library, unless it is set or it is too late.

    Returns what was chosen. Nothing is said if there is none: other backends do without LLVM, and
    `require_llvm` has the words.
    """
    if "drjit" in sys.modules or os.environ.get(VARIABLE):
        return None
    library = _best()
    if library is not None:
        os.environ[VARIABLE] = str(library.path)
    return library


def _best(apart_from: Library | None = None) -> Library | None:
    for file in in_folders():  # the quick way out: no child process at all
        library = Library.at(file)
        if library.version == TRUSTED and library != apart_from and library.path.is_file():
            return library
    others = (library for library in find_llvm() if library != apart_from)
    return next((library for library in others if fault_of(library) is None), None)


def loaded_llvm_version() -> tuple[int, int, int] | None:
    """(major, minor, patch) of the LLVM that Dr.Jit runs on; None if it has none, or none yet."""
    if "drjit" not in sys.modules:
        return None
    from drjit.detail import llvm_version

    major, minor, patch = llvm_version()
    return (major, minor, patch) if major > 0 else None


def require_llvm() -> None:
    """Make sure that this process can compile with LLVM.

    Raises
    ------
    DiffractionError
        If it cannot: what there is, what would do, and how to get it.
    """
    if "drjit" in sys.modules:
        _require_loaded()
        return
    named = named_library()
    if named is not None:
        if fault := fault_of(named):
            raise DiffractionError(_bad_choice(named, fault))
    elif _best() is None:
        raise DiffractionError(_nothing_usable())


def require_loaded_llvm() -> None:
    """`require_llvm` where Mitsuba's current variant compiles with LLVM; nothing elsewhere."""
    import mitsuba as mi

    if (mi.variant() or "").startswith("llvm"):
        _require_loaded()


@functools.lru_cache(maxsize=1)  # what is loaded stays loaded, so once proved is enough
def _require_loaded() -> None:
    version = loaded_llvm_version()
    named = named_library()
    if version is not None and _survives(version[0], named):
        return
    if named is not None and (version is None or named.version in (None, version[0])):
        raise DiffractionError(_bad_choice(named, fault_of(named) or "Dr.Jit cannot load it"))
    if version is None:
        raise DiffractionError(
            f"Dr.Jit has found no LLVM; {_start_again()}" if _best() else _nothing_usable()
        )
    number = ".".join(map(str, version))
    raise DiffractionError(
        f"Dr.Jit has loaded LLVM {number}, which would end the process; {_start_again()}"
    )


def _survives(major: int, named: Library | None) -> bool:
    """Whether the version that Dr.Jit has loaded is one to compile with."""
    if major == TRUSTED or major < OLDEST:
        return major == TRUSTED
    # Dr.Jit does not tell the file: the one named, or of this version, or its own choice again
    same = [library for library in find_llvm() if library.version == major]
    if named is not None and named.version in (None, major):
        same.insert(0, named)
    return tried(same[0].path if same else None) == (major, True)


# ------------------------------------------------------------------------------- messages


def _bad_choice(named: Library, fault: str) -> str:
    best = _best(apart_from=named)
    remedy = f"set it to {best.path}, or unset it" if best else f"unset it, and {_install()}"
    return f'{VARIABLE}="{os.environ.get(VARIABLE)}": {fault}; {remedy}'


def _start_again() -> str:
    best = _best()
    if best is None:
        return _install()
    return (
        "import mitsuba_diffraction before mitsuba and drjit, "
        f"or start again with {VARIABLE}={best.path}"
    )


def _nothing_usable() -> str:
    found = ", ".join(str(library) for library in find_llvm()) or "none"
    return (
        f"there is no LLVM that Dr.Jit can use; found: {found}; usable: {TRUSTED}, or another from "
        f"{OLDEST} on that survives a trial kernel; {_install()}"
    )


def _install() -> str:
    if sys.platform == "darwin":
        return f"brew install llvm@{TRUSTED}"
    if sys.platform == "win32":
        return f"install LLVM {TRUSTED}, and set {VARIABLE} to its LLVM-C.dll"
    return f"apt install libllvm{TRUSTED}, or set {VARIABLE} to one elsewhere"
