"""Kernels that LLVM compiles quickly: short vectors, no optimisation; and what kernels call.

Most of the tests' time would else be LLVM's. Neither changes what a kernel computes: Dr.Jit allows
LLVM no liberties with floating-point numbers.
"""

from __future__ import annotations

import ctypes
import functools
import os
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mitsuba_diffraction.llvm import VARIABLE as LIBRARY


def compile_quickly() -> int:
    """Compile quickly in this process from now on; return the lanes of the processor's vectors."""
    skip_optimisation()
    before = vectors_of(8)
    vectors_of(min(8, before))
    return before


def skip_optimisation() -> None:
    """Make LLVM translate kernels of this process as they are, as compilers do at -O0.

    Compiling costs a fifth, running the kernels 1.3 times as much. LLVM ignores an option that it
    does not know.
    """
    path = os.environ.get(LIBRARY)
    if path is None:
        return
    options = (b"-force-attribute=noinline", b"-force-attribute=optnone", b"-optimize-regalloc=0")
    words = (ctypes.c_char_p * (len(options) + 1))(b"", *options)
    ctypes.CDLL(path).LLVMParseCommandLineOptions(len(words), words, None)


def vectors_of(lanes: int) -> int:
    """Let LLVM's vectors hold so many lanes from now on; return how many they held before.

    Kernels of 16 lanes, of processors that have them, cost half as much again to compile as those
    of 8. Python has no name for this function of Dr.Jit's: where it is not found, or no LLVM is,
    nothing changes.
    """
    import drjit as dr

    if not dr.has_backend(dr.JitBackend.LLVM):
        return lanes
    library = _core()
    try:
        width, set_target = (
            library._Z21jit_llvm_vector_widthv,
            library._Z19jit_llvm_set_targetPKcS0_j,
        )
        described = library._Z19jit_llvm_target_cpuv, library._Z24jit_llvm_target_featuresv
    except AttributeError:
        return lanes
    for text in described:
        text.restype = ctypes.c_char_p
    before = int(width())
    set_target(*(ctypes.c_char_p(text()) for text in described), ctypes.c_uint32(lanes))
    return before


def transform_once() -> None:
    """Let `@dr.syntax` transform a function once, in this process from now on.

    Each change of variant loads Mitsuba's integrators again, and most of its time is that of their
    transformation, which depends on their code alone.
    """
    import drjit as dr

    transform, codes = dr.syntax, {}

    def syntax(function: Any = None, **options: bool) -> Callable:
        if function is None:
            return functools.partial(syntax, **options)
        key = function.__module__, function.__code__, *options.items()
        if key not in codes:
            codes[key] = transform(function, **options).__code__
        made = types.FunctionType(codes[key], function.__globals__)
        made.__defaults__ = function.__defaults__
        return made

    dr.syntax = syntax


#: Kinds of Mitsuba's objects that kernels call.
_CALLED = b"BSDF", b"Texture", b"Emitter", b"Shape"

#: Variant, kind, number and address of one of them.
Called = tuple[str, bytes, int, int]


def called_objects() -> set[Called] | None:
    """Return the objects that kernels would call now; None where Dr.Jit tells of none."""
    import mitsuba as mi

    library = _core()
    try:
        largest = library._Z21jit_registry_id_boundPKcS0_
        address = library._Z16jit_registry_ptrPKcS0_j
    except AttributeError:
        return None
    address.restype = ctypes.c_void_p
    numbered = (
        (variant, kind, number, address(variant.encode(), kind, ctypes.c_uint32(number)))
        for variant in mi.variants()
        for kind in _CALLED
        for number in range(1, 1 + largest(variant.encode(), kind))
    )
    return {entry for entry in numbered if entry[-1]}


@functools.cache
def _core() -> ctypes.CDLL | None:
    """Return Dr.Jit's library, None where it has another name."""
    import drjit as dr

    try:
        return ctypes.CDLL(str(Path(dr.__file__).with_name("libdrjit-core.so")))
    except OSError:
        return None
