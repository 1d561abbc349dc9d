"""What `eval` is compared with: other BSDFs and settings, the thesis' look-up, bare gathers.

No warning tells how far the model holds for the patch: here it is there to be looked up.
"""

from __future__ import annotations

import contextlib
import os
import statistics
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from mitsuba.python import tensor_io
from numpy.typing import NDArray

from ...errors import DiffractionWarning
from ...heights import gratings
from ...heights.field import HeightField
from ...plugin.lookup import DeviceTable
from ...plugin.memory import upload
from ...plugin.restricted import device_table
from ...progress import Progress
from ...tables.table import DiffractionTable
from .figures import PIXEL, SEED, Plan

#: Calls before the first that counts: the first compiles, the second finds the processor awake.
WARM_UP = 2


def kernel_seconds(call: Callable[[], Any]) -> float:
    """Time that the kernels of one call take, without what Python needs to put them together."""
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(call())
        dr.sync_thread()
        return sum(entry["execution_time"] for entry in dr.kernel_history()) * 1e-3


def rounds_of(
    calls: Mapping[str, Callable[[], float]], rounds: int, done: Callable[[int, int], None]
) -> dict[str, list[float]]:
    """Seconds of every call in every round; each round goes through all of them in turn.

    So background load affects all candidates alike, and ratios within a round can be trusted.
    """
    seconds: dict[str, list[float]] = {name: [] for name in calls}
    for n in range(WARM_UP + rounds):
        for name, call in calls.items():
            took = call()
            if n >= WARM_UP:
                seconds[name].append(took)
        done(n + 1, WARM_UP + rounds)
    return seconds


def ratio(a: Sequence[float], b: Sequence[float]) -> float:
    """Median over the rounds of a/b."""
    return statistics.median(x / y for x, y in zip(a, b, strict=True))


def saved_bsdf(table: str | os.PathLike[str], **parameters: Any) -> Any:
    """The plugin with a table."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DiffractionWarning)
        return mi.load_dict({"type": "diffraction", "table": str(table), **parameters})


def thesis_bsdf(table: str | os.PathLike[str], **parameters: Any) -> Any:
    """The same, looked up by `TermImages`; the table is a coherent Taylor series."""
    bsdf = saved_bsdf(table, **parameters)
    bsdf.power.device = TermImages(bsdf.table)
    return bsdf


class TermImages(DeviceTable):
    """A coherent Taylor table as the thesis keeps it, an image of complex numbers a term.

    For every wavelength and every term, the 3 × 3 texels around the asked frequency are fetched
    from that term's image, weighted by the Gaussian window, and added up. `plugin.lookup` can hold
    the same series, but keeps all terms of one bin together. Only `window_sum` differs.
    """

    def __init__(self, table: DiffractionTable) -> None:
        super().__init__(table)
        images = np.moveaxis(table.coefficients[0], -1, 0)  # (terms, ny, nx, re and im)
        self._images = upload(mi.Float, np.ascontiguousarray(images))

    def window_sum(self, qx: Any, qy: Any, kappa: Any, windows: Any = ()) -> Any:
        """Σ over orders under the window, dimensionless (`tables.lookup.window_sum`)."""
        grid, expansion = self.grid, self.expansion
        x, y = qx * (1.0 / self.spacing[0]), qy * (1.0 / self.spacing[1])
        first, weight_x, weight_y = self._place(x, y, mi.UInt32(0))
        weights = [
            (grid.index(0, row, column), weight_x(column) * weight_y(row))
            for row in range(grid.taps[1])
            for column in range(grid.taps[0])
        ]
        lobe = dr.exp(-grid.exponents[0] * dr.square(x) - grid.exponents[1] * dr.square(y))
        order_0 = mi.Complex2f(*(lobe * c for c in self.series.at(kappa)[2]))
        scaled = kappa * expansion.half_range

        def of_term(n: Any, image: Any, weight: Any, total: Any) -> tuple[Any, ...]:
            weight *= scaled / mi.Float(n)  # xⁿ/n!
            windowed = mi.Complex2f(0.0)
            for offset, gaussian in weights:
                windowed += gaussian * dr.gather(mi.Complex2f, self._images, image + offset)
            return n + 1, image + grid.index(1, 0, 0), weight, total + weight * windowed

        state = (mi.UInt32(1), first, mi.Float(1.0), order_0)
        total = dr.while_loop(state, lambda n, *_: n <= expansion.terms, of_term)[3]
        return dr.squared_norm(total)


ALUMINIUM = "roughconductor, Al"
DEFAULT = "diffraction, the defaults"
DEFAULT_AL = "diffraction, Al"
KIRCHHOFF = "diffraction, kirchhoff"
KIRCHHOFF_AL = "diffraction, Al, kirchhoff"
FIRST_ORDER = "diffraction, first order"
COARSE = "diffraction, tolerance 1e-2"
ONE_WINDOW = "diffraction, patch"
ON_SURFACE = "diffraction, surface"
TILED = "diffraction, surface, random tiles"
THESIS = "thesis: Taylor, 37 terms, 3×3, an image a term"
TAYLOR = "the same series, all terms of a bin together"


@dataclass(frozen=True)
class Tables:
    """The tables of one patch that the contenders look up, as files."""

    folder: Path
    patch: str
    heights: HeightField
    paths: dict[str, Path] = field(default_factory=dict)

    def bsdf(self, name: str, **parameters: Any) -> Any:
        """The plugin with one of the tables, in the current variant."""
        return saved_bsdf(self.paths[name], **parameters)

    def load(self, name: str) -> DiffractionTable:
        """One of the tables."""
        return DiffractionTable.load(self.paths[name])


def build_tables(
    plan: Plan,
    folder: Path,
    progress: Progress,
    patch: HeightField | None = None,
) -> Tables:
    """Build and save them, of `elaphe_like` if no patch is given."""
    if patch is None:
        patch = gratings.elaphe_like(plan.pixels * PIXEL, plan.pixels)
    settings: dict[str, dict[str, Any]] = {
        "default": {},
        "1e-2": {"tolerance": 1e-2},
        "patch": {"coherence": "patch"},
        # no tolerance could be met by this
        "thesis": {
            "coherence": "patch", "basis": "taylor", "terms": 37, "taps": 3, "tolerance": 0.999,
        },
    }  # fmt: skip
    words = f"{patch.name}, {patch.heights.shape[1]} × {patch.heights.shape[0]}"
    tables = Tables(folder, words, patch)
    for n, (name, arguments) in enumerate(settings.items()):
        progress(n, len(settings), "building tables")
        tables.paths[name] = folder / f"{name}.exr"
        DiffractionTable.build(patch, **arguments).save(tables.paths[name])
    progress(len(settings), len(settings), "building tables")
    return tables


def bsdf_factories(tables: Tables) -> dict[str, Callable[[], Any]]:
    """Functions that make the contenders, by name, in the current variant."""

    def ours(table: str, **parameters: Any) -> Callable[[], Any]:
        return lambda: tables.bsdf(table, **parameters)

    def measured() -> Any:
        file = tables.folder / "even.bsdf"
        if not file.exists():
            write_measured(file)
        return mi.load_dict({"type": "measured", "filename": str(file)})

    return {
        ALUMINIUM: lambda: mi.load_dict({"type": "roughconductor", "material": "Al"}),
        "principled, metal": lambda: mi.load_dict(
            {"type": "principled", "metallic": 1.0, "roughness": 0.3}
        ),
        "measured": measured,
        DEFAULT: ours("default"),
        KIRCHHOFF: ours("default", model="kirchhoff"),
        DEFAULT_AL: ours("default", material="Al"),
        KIRCHHOFF_AL: ours("default", material="Al", model="kirchhoff"),
        FIRST_ORDER: ours("default", second_order=False),
        COARSE: ours("1e-2"),
        ONE_WINDOW: ours("patch"),
        ON_SURFACE: ours("patch", coherence="surface", uv_scale=1e4),
        TILED: ours("patch", coherence="surface", uv_scale=1e4, tiling="random"),
        THESIS: lambda: thesis_bsdf(tables.paths["thesis"]),
        TAYLOR: ours("thesis"),
    }


def is_slow(name: str) -> bool:
    """Whether fewer calls do, for the sake of the user's time."""
    return name in (THESIS, TAYLOR)


@dataclass(frozen=True)
class Queries:
    """Random questions to a BSDF, evaluated and in memory."""

    si: Any
    wo: Any
    sample1: Any
    sample2: Any

    @classmethod
    def random(cls, lanes: int) -> Queries:
        """Directions uniform over the hemisphere, wavelengths as Mitsuba draws them, any place."""
        random = mi.PCG32(size=lanes, initstate=SEED)

        def hemisphere() -> Any:
            pair = mi.Point2f(random.next_float32(), random.next_float32())
            return mi.warp.square_to_uniform_hemisphere(pair)

        si = dr.zeros(mi.SurfaceInteraction3f, lanes)
        si.wi = hemisphere()
        wo = hemisphere()
        if mi.is_spectral:
            si.wavelengths = mi.sample_rgb_spectrum(mi.sample_shifted(random.next_float32()))[0]
        sample1 = random.next_float32()
        sample2 = mi.Point2f(random.next_float32(), random.next_float32())
        si.uv = mi.Point2f(random.next_float32(), random.next_float32())
        dr.eval(si, wo, sample1, sample2)
        return cls(si, wo, sample1, sample2)


def bare_gathers(table: DiffractionTable, queries: Queries) -> Callable[[], Any]:
    """All packets that `eval` reads for these queries, added up: the floor beneath any look-up.

    Where they are is found out beforehand.
    """
    device = device_table(table)
    assert isinstance(device, DeviceTable)  # only scalar variants have another
    si, total = queries.si, queries.si.wi + queries.wo
    firsts = []
    for n in range(len(si.wavelengths)):
        k = 2e3 * dr.pi / si.wavelengths[n]
        firsts.append(device.first_bin(k * total.x, k * total.y, k * total.z))
    dr.eval(firsts)

    def body(n: Any, firsts: list[Any], total: Any) -> tuple[Any, list[Any], Any]:
        for row, columns in enumerate(table.grid.tapped()):
            for column in columns:
                for packet in device.read(firsts[0] + table.grid.index(0, row, column)):
                    total += dr.sum(packet, axis=0)
        return n + 1, [*firsts[1:], firsts[0]], total

    def call() -> Any:
        state = (mi.UInt32(0), firsts, mi.Float(0.0))
        return dr.while_loop(state, lambda n, *_: n < len(firsts), body)[2]

    return call


# what an anisotropic surface takes, in the sampling of Dupuy and Jakob 2018
AZIMUTHS, ANGLES, WAVELENGTHS, SIDE = 8, 8, 195, 32


def write_measured(path: Path) -> None:
    """A surface that reflects alike everywhere: values do not matter for the time that it takes."""

    def ones(*shape: int) -> NDArray[np.float32]:
        return np.ones(shape, np.float32)

    arrays: dict[str, Any] = {
        "description": "even",
        "theta_i": np.linspace(0.0, 1.5, ANGLES, dtype=np.float32),
        "phi_i": np.linspace(-np.pi, np.pi, AZIMUTHS, dtype=np.float32),
        "ndf": ones(128, 128),
        "sigma": ones(128, 128),
        "vndf": ones(AZIMUTHS, ANGLES, 128, 128),
        "luminance": ones(AZIMUTHS, ANGLES, SIDE, SIDE),
        "spectra": ones(AZIMUTHS, ANGLES, WAVELENGTHS, SIDE, SIDE),
        "wavelengths": np.linspace(360.0, 1000.0, WAVELENGTHS, dtype=np.float32),
        "jacobian": np.zeros(1, np.uint8),
    }
    with contextlib.redirect_stdout(None):  # it says what it wrote
        tensor_io.write(str(path), **arrays)
