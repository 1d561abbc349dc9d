"""What is no longer used is let go, however often scenes are loaded."""

from __future__ import annotations

import gc
import resource
import weakref
from pathlib import Path

import drjit as dr
import mitsuba as mi
import pytest

from tests.directions import rough_patch
from tests.plugin.plates import diffraction, plate, rendered, scene

# coarse pixels keep the tables small; that is not the point here
pytestmark = pytest.mark.filterwarnings("ignore::mitsuba_diffraction.DiffractionWarning")
LOADED = ("scalar_spectral", "llvm_ad_spectral", "llvm_ad_rgb", "llvm_ad_mono")


@pytest.mark.parametrize("name", LOADED)
def test_what_is_no_longer_used_is_let_go(name):
    if name.startswith("llvm") and not dr.has_backend(dr.JitBackend.LLVM):
        pytest.skip(f"{name}: Dr.Jit finds no device for it")
    mi.set_variant(name)
    bsdf = mi.load_dict(diffraction(energy_conserving=True))
    si, sampled = dr.zeros(mi.SurfaceInteraction3f), (0.4, mi.Point2f(0.3, 0.6))
    si.wi = mi.Vector3f(0.1, 0.2, 0.97)
    if mi.is_spectral:
        si.wavelengths = mi.Spectrum(400.0, 500.0, 600.0, 700.0)
    dr.eval(bsdf.sample(mi.BSDFContext(), si, *sampled))
    table = weakref.ref(bsdf.table)
    del bsdf
    gc.collect()
    assert table() is None


def resident() -> float:
    """Memory in use, MB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * resource.getpagesize() / 1e6


def test_scenes_loaded_many_times_do_not_grow_memory(variant):
    if not Path("/proc/self/statm").is_file():
        pytest.skip("no /proc here to read the memory in use from")
    # large enough to be seen: 2 MB of coefficients and as much again of proposals
    fields = [rough_patch((300, 300), (0.1, 0.1), 0.1 + 0.01 * n, seed=n) for n in range(5)]
    size = 0.0
    for n in range(34):
        loaded = scene(plate(diffraction(fields[n % 5], coherence_width=25.0)), size=4)
        rendered(loaded, 4)
        size = max(size, loaded.shapes()[0].bsdf().table.nbytes / 1e6)
        del loaded
        gc.collect()
        if n == 13:  # all tables built, all kernels compiled, all pools of memory filled
            before = resident()
    assert size > 1.0  # or the test would say little
    # 20 leaked tables would be 20 times that, without their proposals and copies; the allocator
    # alone is seen to keep 8 MB in a process that has run many other tests
    assert resident() - before < 10.0 * size
