"""Naming an LLVM to Dr.Jit in time, and saying in one line why none will do."""

from __future__ import annotations

import os
import sys

from ...errors import DiffractionError
from .find import OLDEST, TESTED, VARIABLE, Library, find_llvm, named_library


def select_llvm() -> Library | None:
    """Point DRJIT_LIBLLVM_PATH to the best library, unless it is set or it is too late.

    Returns what was chosen. Nothing is said if there is none: other backends do without LLVM, and
    `require_llvm` has the words.
    """
    if "drjit" in sys.modules or os.environ.get(VARIABLE):
        return None
    library = _best()
    if library is not None:
        os.environ[VARIABLE] = str(library.path)
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

    Raises
    ------
    DiffractionError
        If it cannot: what there is, what would do, and how to get it.
    """
    named = named_library()
    if "drjit" in sys.modules:
        _require_loaded(named)
    elif named is not None:
        if fault := _fault_of(named):
            raise DiffractionError(_bad_choice(named, fault))
    elif _best() is None:
        raise DiffractionError(_nothing_usable())


def require_loaded_llvm() -> None:
    """`require_llvm` where Mitsuba's current variant compiles with LLVM; nothing elsewhere."""
    import mitsuba as mi

    if (mi.variant() or "").startswith("llvm"):
        _require_loaded(named_library())


def _require_loaded(named: Library | None) -> None:
    version = loaded_llvm_version()
    if version is not None and version[0] >= OLDEST:
        return
    if named is not None and (version is None or named.version in (None, version[0])):
        fault = _too_old(version[0]) if version else _fault_of(named)
        raise DiffractionError(_bad_choice(named, fault or "Dr.Jit cannot load it"))
    if version is None:
        raise DiffractionError(
            f"Dr.Jit has found no LLVM; {_start_again()}" if _best() else _nothing_usable()
        )
    number = ".".join(map(str, version))
    raise DiffractionError(
        f"Dr.Jit has loaded LLVM {number}, which would end the process; {_start_again()}"
    )


def _best(apart_from: Library | None = None) -> Library | None:
    libraries = (library for library in find_llvm() if library != apart_from)
    return next((library for library in libraries if _fault_of(library) is None), None)


def _fault_of(library: Library) -> str | None:
    """Why Dr.Jit cannot work with it, as a clause, or None; a version untold may do."""
    if not library.path.is_file():
        return "there is no such file"
    if library.version is not None and library.version < OLDEST:
        return _too_old(library.version)
    return None


# ------------------------------------------------------------------------------- messages


def _too_old(version: int) -> str:
    return f"LLVM {version} cannot compile the kernels of Dr.Jit"


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
        f"there is no LLVM that Dr.Jit can use; found: {found}; usable: {OLDEST} or newer, best "
        f"{TESTED}; {_install()}"
    )


def _install() -> str:
    if sys.platform == "darwin":
        return f"brew install llvm@{TESTED}"
    if sys.platform == "win32":
        return f"install LLVM {TESTED}, and set {VARIABLE} to its LLVM-C.dll"
    return f"apt install libllvm{TESTED}, or set {VARIABLE} to one elsewhere"
