"""What is no longer used is let go; kernels read what was stored, and nothing beside it."""

from __future__ import annotations

import gc
import subprocess
import sys
import weakref
from collections.abc import Iterator

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from mitsuba_diffraction.plugin.memory import HalfFloats, index_between
from tests.support import ROOT
from tests.support.kinds import KINDS, MIX, THROUGH, made
from tests.support.lanes import interaction
from tests.support.plates import diffraction, plate, rendered, scene
from tests.support.variants import use

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


@pytest.mark.thorough
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


@pytest.mark.thorough
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


#: Uploads arrays that end where a page of memory ends that must not be read.
AT_THE_EDGE = """
import ctypes, mmap, numpy as np, mitsuba as mi
mi.set_variant("llvm_ad_spectral")
from mitsuba_diffraction.plugin.memory import tensor, upload
page, libc = mmap.PAGESIZE, ctypes.CDLL(None)
pages = mmap.mmap(-1, 2 * page)
start = ctypes.addressof(ctypes.c_char.from_buffer(pages))
assert libc.mprotect(ctypes.c_void_p(start + page), ctypes.c_size_t(page), 0) == 0
for kind, stored in ((mi.Float, np.float32), (mi.UInt32, np.uint32)):
    values = np.frombuffer(pages, stored, 17, page - 17 * 4)
    assert not np.array(upload(kind, values)).any()
assert not np.array(tensor(values.view(np.float32)) + 0.0).any()
"""
#: Least normal half float; smaller ones are read as 0.
NORMAL = 2.0**-14


@pytest.mark.parametrize("numbers", [1, 2, 3, 4, 6, 8, 10, 16, 24, 32, 40])
def test_halves_are_read_as_stored(some_variant: str, numbers: int) -> None:
    generator = np.random.default_rng(numbers)
    sizes = 2.0 ** generator.uniform(-20.0, 15.9, (50, numbers))
    stored = (sizes * generator.choice([-1.0, 0.0, 1.0], sizes.shape)).astype(np.float16)
    places = generator.permutation(50)
    halves = HalfFloats(stored)
    packets = halves.read(mi.UInt32(places))
    dr.eval(packets)  # one kernel
    read = np.stack([np.array(x) for packet in packets for x in packet], axis=1) * halves.scale
    expected = np.where(np.abs(stored) < NORMAL, np.float16(0), stored)[places]
    np.testing.assert_array_equal(read[:, :numbers], expected)
    assert not read[:, numbers:].any()


def test_inactive_lanes_read_zeros(some_variant: str) -> None:
    halves = HalfFloats(np.ones((3, 8), np.float16))
    far, active = mi.UInt32([1, 1 << 30]), mi.Bool([True, False])
    sums = sum(dr.sum(packet, axis=0) for packet in halves.read(far, active))
    np.testing.assert_array_equal(np.array(sums) * halves.scale, [8.0, 0.0])


@pytest.mark.skipif(sys.platform == "win32", reason="memory is protected by a function of Unix")
def test_no_memory_beyond_an_array_is_read() -> None:
    subprocess.run([sys.executable, "-c", AT_THE_EDGE], check=True)


# In a child: a read outside the table may end the process, where memory happens to end.
PROGRAM = """
import numpy as np, drjit as dr, warnings
warnings.simplefilter("ignore")
import mitsuba_diffraction as md, mitsuba as mi
from tests.support.coarse import coarse_energy
from tests.support.kernels import compile_quickly
coarse_energy()
compile_quickly()
mi.set_variant("llvm_ad_spectral")
heights = np.random.default_rng(0).uniform(0.0, 0.2, (300, 300))
field = md.HeightField(heights, 0.08)
bsdf = mi.load_dict(md.bsdf_dict(field, material="none", coherence_width=24.0))
right = dr.opaque(mi.Float, 0.5, 1000)
si = dr.zeros(mi.SurfaceInteraction3f, 1000)
si.wavelengths = mi.Spectrum(550.0)
for number in ("nan", "1e30"):
    for wrong in range(6):
        # arrays of their own, so that one kernel serves all
        parts = [dr.opaque(mi.Float, 0.5**0.5 if n % 3 == 2 else 0.5, 1000) for n in range(6)]
        parts[wrong] = dr.opaque(mi.Float, float(number), 1000)
        si.wi = mi.Vector3f(*parts[:3])
        value, density = bsdf.eval_pdf(mi.BSDFContext(), si, mi.Vector3f(*parts[3:]))
        drawn, weight = bsdf.sample(mi.BSDFContext(), si, right, mi.Point2f(right, right))
        dr.eval(value, density, drawn, weight)
    dr.sync_thread()
    print(number, "is survived")
"""


@pytest.mark.thorough
def test_an_index_is_always_in_its_range(variant: str) -> None:
    values = mi.Float([np.nan, np.inf, -np.inf, 2.0, -1.0, 1e30])
    dr.make_opaque(values)
    np.testing.assert_array_equal(index_between(values, 0.0, 3.0), [0, 3, 0, 2, 0, 3])


@pytest.mark.thorough
def test_directions_that_are_no_numbers_do_not_end_the_process() -> None:
    """As degenerate triangles make them."""
    ran = subprocess.run(
        [sys.executable, "-c", PROGRAM], cwd=ROOT, capture_output=True, text=True, timeout=120
    )
    said = ["nan is survived", "1e30 is survived"]
    assert (ran.returncode, ran.stdout.splitlines()) == (0, said), ran.stderr
