"""What is no longer used is let go, however often scenes are loaded."""

from __future__ import annotations

import gc
import tracemalloc
import weakref
from collections.abc import Iterator

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.support.directions import rough_patch
from tests.support.kinds import KINDS, MIX, THROUGH, made
from tests.support.lanes import interaction
from tests.support.plates import diffraction, plate, rendered, scene
from tests.support.variants import use

pytestmark = pytest.mark.thorough
#: Variants that a mirror is loaded in; other kinds are in the second.
LOADED = ("scalar_spectral", "llvm_ad_spectral", "llvm_ad_rgb", "llvm_ad_mono")


@pytest.fixture
def without_gc() -> Iterator[None]:
    """References alone free what is freed: a cycle of them would wait for a collection, and Dr.Jit
    would compile the BSDF in it into every kernel until then.
    """
    gc.disable()
    yield
    gc.enable()


@pytest.mark.parametrize(
    ("variant", "kind"),
    [(name, "mirror") for name in LOADED]
    + [("llvm_ad_spectral", kind) for kind in (*KINDS, *THROUGH, MIX) if kind != "mirror"],
)
def test_a_surface_that_is_no_longer_used_is_let_go(variant, kind, without_gc):
    use(variant)
    bsdf = made(kind, energy_conserving=True)
    si = interaction([0.1, 0.2, 0.97], [[400.0, 500.0, 600.0, 700.0]])
    dr.eval(bsdf.sample(mi.BSDFContext(), si, 0.4, mi.Point2f(0.3, 0.6)))
    surfaces = [bsdf] if kind != MIX else [bsdf, *bsdf.bsdfs.values()]
    kept = [weakref.ref(one) for one in surfaces]
    kept += [weakref.ref(one.table) for one in surfaces if hasattr(one, "table")]
    del bsdf, surfaces
    assert [one() for one in kept] == [None] * len(kept)


def test_a_scene_lets_its_surface_go(some_variant, without_gc):
    """Also once it is rendered, and rendered again with another parameter."""
    loaded = scene(plate(diffraction()), size=4)
    bsdf = weakref.ref(loaded.shapes()[0].bsdf())
    parameters = mi.traverse(loaded)
    scale = next(name for name in parameters.keys() if name.endswith("height_scale"))  # noqa: SIM118
    pictures = []
    for parameters[scale] in (mi.Float(1.0), mi.Float(0.5)):
        parameters.update()
        pictures.append(rendered(loaded, 4))
    assert not np.allclose(*pictures)
    del loaded, parameters
    assert bsdf() is None


def in_use() -> tuple[int, int, int]:
    """Bytes that Python and NumPy hold, Dr.Jit's variables, and the kernels it has compiled.

    Not the memory of the process: what the allocators keep for later depends on what ran before.
    """
    variables = dr.whos(as_string=True).count("\n")
    return tracemalloc.get_traced_memory()[0], variables, sum(dr.detail.launch_stats()[1:])


def test_scenes_loaded_many_times_do_not_grow_memory(variant, without_gc):
    fields = [rough_patch((120, 120), (0.1, 0.1), 0.1 + 0.01 * n, seed=n) for n in range(3)]
    tracemalloc.start()
    try:
        for n in range(9):
            loaded = scene(plate(diffraction(fields[n % 3], coherence_width=10.0)), size=4)
            rendered(loaded, 4)
            size = loaded.shapes()[0].bsdf().table.nbytes
            del loaded
            if n == 5:  # all tables built and read once, all kernels compiled
                before = in_use()
        grown, variables, kernels = np.subtract(in_use(), before)
    finally:
        tracemalloc.stop()
    assert size > 200_000  # or the test would say little
    # three tables at least leak if one does at each load; Mitsuba's parser leaves a few cycles
    assert grown < 0.1 * size
    assert variables <= 0
    # one at each of three loads if a surface stays; else hardly any: kernels hold the numbers that
    # objects have in Dr.Jit's register, which are given out anew in no fixed order
    assert kernels < 3
