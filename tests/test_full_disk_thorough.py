"""A disk that becomes full leaves a whole file or the file that was there, and an error.

The bound that a process may set to the size of its files refuses bytes as a full disk does.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

import mitsuba_diffraction as md
from mitsuba_diffraction.analysis.export.rgl import DEFAULT, save_rgl
from mitsuba_diffraction.cli import save_json
from mitsuba_diffraction.scene.frames import FILMS, write_film
from mitsuba_diffraction.scene.orientation import TriangleMesh, write_ply
from mitsuba_diffraction.scene.pictures import write_exr, write_png
from mitsuba_diffraction.tables import write_channels
from mitsuba_diffraction.tables.store import Record, write_record
from tests.support.directions import rough_patch
from tests.support.orders import thin_grating

resource = pytest.importorskip("resource", reason="no bounds of a process here")

pytestmark = [pytest.mark.thorough, pytest.mark.usefixtures("some_variant")]


def writers(scratch: Path) -> dict[str, Callable[[Path], None]]:
    """Return functions that write small files by name; frames of films lie in `scratch`."""
    rng = np.random.default_rng(1)
    noise = {n: rng.random((n, n, 3)).astype(np.float32) for n in (8, 30)}
    pictures = {n: mi.Bitmap(values) for n, values in noise.items()}
    table = md.DiffractionTable.build(rough_patch((12, 12), (0.1, 0.1), 0.05), coherence_width=1.0)
    orders = thin_grating(period=0.6)
    frames = []
    for n in range(3):
        frames.append(scratch / f"{n}.png")
        Image.fromarray((noise[30] * 80 * n).astype(np.uint8)).save(frames[-1])
    grid = DEFAULT._replace(
        theta=np.array([0.0, 40.0]), phi=np.array([-180.0, 180.0]), resolution=8,
        wavelengths=np.array([500.0, 600.0]),
    )  # fmt: skip
    table.save(scratch / "table.exr")
    raw = {"material": "none", "energy_conserving": False}
    surface = mi.load_dict(md.bsdf_dict(scratch / "table.exr", **raw))
    brdf_map = md.maps.brdf_map(surface, 30.0, resolution=8)
    triangle = TriangleMesh(np.eye(3), np.eye(3), np.eye(3)[:, :2], np.array([[0, 1, 2]]))
    found: dict[str, Callable[[Path], None]] = {
        "table.exr": table.save, "orders.nc": orders.save,
        "small.exr": lambda path: write_exr(pictures[8], path, {}),
        "large.exr": lambda path: write_exr(pictures[30], path, {}),
        "small.png": lambda path: write_png(pictures[8], path),
        "large.png": lambda path: write_png(pictures[30], path),
        "channels.exr": lambda path: write_channels(path, {"Y": noise[8][..., 0]}),
        "many.exr": lambda path: write_channels(path, {"RGBA": noise[30][..., [0, 1, 2, 0]]}),
        "text.json": lambda path: save_json(path, {"a": [0.5] * 500}),
        "map.png": lambda path: md.maps.save_png(brdf_map, path),
        "rgl.bsdf": lambda path: save_rgl(surface, path, grid),
        "mesh.ply": lambda path: write_ply(path, triangle),
        "record.cache": lambda path: write_record(path, "t", Record({}, [noise[30]])),
    }  # fmt: skip
    for suffix in FILMS:
        found[f"film{suffix}"] = lambda path: write_film(frames, path, 10)
    try:
        import imageio_ffmpeg  # noqa: F401
    except ImportError:
        del found["film.mp4"]
    return found


@contextlib.contextmanager
def files_of_at_most(size: int) -> Iterator[None]:
    """Bound the size, bytes, of files that this process and its children write."""
    _, hard = before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_no_writer_leaves_a_part_of_a_file(tmp_path):
    scratch, folder = tmp_path / "scratch", tmp_path / "folder"
    for each in (scratch, folder):
        each.mkdir()
    for name, write in writers(scratch).items():
        write(scratch / name)
        target, size = folder / name, (scratch / name).stat().st_size
        target.write_bytes(b"what was there before")
        for most in (0, 1, size // 3, 4096, 8192, size - 1):
            with files_of_at_most(min(most, size - 1)), pytest.raises(md.DiffractionError):
                write(target)
            assert target.read_bytes() == b"what was there before", (name, most)
        write(target)
        assert target.read_bytes() == (scratch / name).read_bytes(), name
        assert {path.name for path in folder.iterdir()} == {name}, name
        target.unlink()
