"""An LLVM that Dr.Jit survives, chosen before Dr.Jit loads one.

Dr.Jit 1.5 loads LLVM while `drjit` is imported, and keeps it: the file that DRJIT_LIBLLVM_PATH
names, else the loader's `libLLVM.so`, else the highest-numbered libLLVM*.so.* of the system's
library folder. It refuses version 14 and older itself; 15 and 16 load, and end the whole process
at the first kernel with a minimum or maximum ("Cannot select ... fminimum"). So the choice is made
here, on import of the package, and later use checks what was loaded.

Contents
--------
find_llvm            what this machine has
select_llvm          name the best to Dr.Jit, while there is time
loaded_llvm_version  what Dr.Jit did load
require_llvm         raise DiffractionError in one line if none will do
require_loaded_llvm  the same, where Mitsuba's current variant compiles with LLVM
"""

from __future__ import annotations

from .choose import loaded_llvm_version, require_llvm, require_loaded_llvm, select_llvm
from .find import Library, find_llvm

__all__ = [
    "Library",
    "find_llvm",
    "loaded_llvm_version",
    "require_llvm",
    "require_loaded_llvm",
    "select_llvm",
]
