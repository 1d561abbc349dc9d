"""Files with random damage: refused in one line, or read to something that can be used."""

from __future__ import annotations

import functools
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
from PIL import Image

import mitsuba_diffraction as md
from mitsuba_diffraction.heights.recipes import Recipe
from mitsuba_diffraction.scene.orientation.files import load_mesh
from tests.directions import rough_patch
from tests.instruments import nanoscope

_MOST = 500  # characters of a message
_RECIPE = 'generator = "sinusoidal"\ncoherence_width = 4\n[arguments]\nperiod = 1.6\ndepth = 0.06\n'
_PLY = """ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""


@functools.cache
def originals() -> dict[str, bytes]:
    """Small whole files by name."""
    field = rough_patch((20, 24), (0.1, 0.1), 0.1)
    grey = np.uint8(255 * (field.heights - field.heights.min()) / np.ptp(field.heights))
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        for name, more in {
            "ensemble.exr": {}, "patch.exr": {"coherence": "patch"},
            "chebyshev.exr": {"basis": "chebyshev", "tolerance": 1e-4},
            "taylor.exr": {"basis": "taylor"},
        }.items():  # fmt: skip
            md.DiffractionTable.build(field, coherence_width=2.0, **more).save(at / name)
        for suffix in ("png", "tiff", "bmp"):
            Image.fromarray(grey).save(at / f"grey.{suffix}")
        Image.fromarray(grey.astype(np.uint16) * 257).save(at / "deep.png")
        np.save(at / "heights.npy", field.heights)
        np.savetxt(at / "heights.txt", field.heights)
        (at / "scan.spm").write_bytes(nanoscope(np.int16(1000 * field.heights), scan_size="2 2 ~m"))
        (at / "recipe.toml").write_text(_RECIPE)
        (at / "mesh.ply").write_text(_PLY)
        return {path.name: path.read_bytes() for path in sorted(at.iterdir())}


def damaged(rng: np.random.Generator, content: bytes) -> bytes:
    """The file with a bit flipped, a piece lost, doubled, moved or overwritten."""
    data = bytearray(content)
    start, stop = sorted(rng.integers(len(data) + 1, size=2))
    # most of what matters lies at the beginning
    if rng.random() < 0.5:
        start, stop = sorted(rng.integers(min(len(data), 600) + 1, size=2))
    kind = rng.integers(6)
    if kind == 0 and data:
        data[rng.integers(len(data))] ^= 1 << int(rng.integers(8))
    elif kind == 1:
        del data[start:]
    elif kind == 2:
        del data[start : min(stop, start + 40)]
    elif kind == 3:
        data[start:start] = data[start : min(stop, start + 200)]
    elif kind == 4:
        data[start : min(stop, start + 8)] = rng.bytes(min(8, int(stop - start)))
    else:
        _other_number(rng, data)
    return bytes(data)


def _other_number(rng: np.random.Generator, data: bytearray) -> None:
    """Replace one of the numbers that stand in the file as text."""
    digits = [n for n, byte in enumerate(data) if chr(byte).isdigit()]
    if digits:
        words = [b"-1", b"0", b"1e400", b"nan", b"999999999999", b"null", b"[]", b'"a"']
        place = digits[rng.integers(len(digits))]
        data[place : place + 1] = words[rng.integers(len(words))]


def check_table(rng: np.random.Generator) -> None:
    """A table is refused, or every value that it gives is finite and not negative."""
    _check(rng, [name for name in originals() if name.endswith(".exr")], _use_table)


def check_heights(rng: np.random.Generator) -> None:
    """Heights are refused, or finite."""
    names = [n for n in originals() if not n.endswith((".exr", ".toml", ".ply"))]
    _check(rng, names, _use_heights)


def check_text(rng: np.random.Generator) -> None:
    """Recipes and meshes."""
    _check(rng, ["recipe.toml"], lambda path: Recipe.load(path))
    _check(rng, ["mesh.ply"], lambda path: load_mesh(path))


def _check(rng: np.random.Generator, names: list[str], use: Callable[[Path], object]) -> None:
    name = names[rng.integers(len(names))]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, name)
        path.write_bytes(damaged(rng, originals()[name]))
        try:
            use(path)
        except md.DiffractionError as error:
            assert len(str(error)) <= _MOST, "too long a message"
            assert "\n" not in str(error), "more than one line"


def _use_table(path: Path) -> None:
    table = md.DiffractionTable.load(path)
    rng = np.random.default_rng(1)
    wi, wo = rng.normal(size=(2, 16, 3))
    for w in (wi, wo):
        w[:, 2] = np.abs(w[:, 2]) + 0.1
        w /= np.linalg.norm(w, axis=1)[:, None]
    low, high = table.wavelength_range
    value = table.brdf(wi, wo, rng.uniform(low, high, 16))
    assert np.isfinite(value).all()
    assert (value >= 0.0).all()
    assert value.max() < 1e9


def _use_heights(path: Path) -> None:
    field = md.HeightField.load(path, pixel_size=0.1, max_height=0.1)
    assert np.isfinite(field.heights).all()
