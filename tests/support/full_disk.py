"""Writers on a disk of 64 KiB that is nearly full: the whole file, or an error and the file before.

Run as a program with a folder on which it mounts the disk: `unshare --mount` gives it mounts of its
own. It prints a line for each file that is neither.
"""

from __future__ import annotations

import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path

import matplotlib.pyplot as plt
import mitsuba as mi
import numpy as np
from PIL import Image

import mitsuba_diffraction as md
from mitsuba_diffraction.errors import DiffractionError, DiffractionWarning
from tests.support.kernels import compile_quickly

_SIZE, _PAGE, _BEFORE = 1 << 16, 4096, b"what was there before"


def writers(scratch: Path) -> dict[str, Callable[[Path], None]]:
    """Return functions that write small files by name; frames of films lie in `scratch`."""
    from mitsuba_diffraction.analysis.export.rgl import DEFAULT, save_rgl
    from mitsuba_diffraction.cli.report import save_json
    from mitsuba_diffraction.images import save_figure
    from mitsuba_diffraction.scene.frames import FILMS, write_film
    from mitsuba_diffraction.scene.orientation.mesh_files import write_ply
    from mitsuba_diffraction.scene.orientation.trimesh import TriangleMesh
    from mitsuba_diffraction.scene.pictures import write_exr, write_png
    from mitsuba_diffraction.tables.exr import write_channels
    from mitsuba_diffraction.tables.store import Record, write_record
    from tests.support.directions import rough_patch
    from tests.support.orders import thin_grating

    rng = np.random.default_rng(1)
    noise = {n: rng.random((n, n, 3)).astype(np.float32) for n in (8, 30)}
    pictures = {n: mi.Bitmap(values) for n, values in noise.items()}
    table = md.DiffractionTable.build(rough_patch((12, 12), (0.1, 0.1), 0.05), coherence_width=1.0)
    orders = thin_grating(period=0.6)
    frames = []
    for n in range(3):
        frames.append(scratch / f"{n}.png")
        Image.fromarray((noise[30] * 80 * n).astype(np.uint8)).save(frames[-1])
    figure = plt.figure(figsize=(1, 1))
    grid = DEFAULT._replace(
        theta=np.array([0.0, 40.0]), phi=np.array([-180.0, 180.0]), resolution=8,
        wavelengths=np.array([500.0, 600.0]),
    )  # fmt: skip
    table.save(scratch / "table.exr")
    raw = {"material": "none", "energy_conserving": False}
    surface = mi.load_dict(md.bsdf_dict(scratch / "table.exr", **raw))
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
        "figure.png": lambda path: save_figure(path, figure),
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


def main(folder: Path) -> None:
    """Mount the disk and try all writers with every number of free pages."""
    compile_quickly()
    mi.set_variant("llvm_ad_spectral")
    warnings.simplefilter("ignore", DiffractionWarning)
    scratch, disk = folder / "scratch", folder / "disk"
    for each in (scratch, disk):
        each.mkdir()
    expected = {}
    found = writers(scratch)
    for name, write in found.items():
        write(scratch / name)
        expected[name] = (scratch / name).read_bytes()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={_SIZE}", "tmpfs", str(disk)]
    subprocess.run(mount, check=True)
    tried = 0
    for name, write in found.items():
        for free in (0, 1, 2, 3, 5, 8, 11):
            target, filler = disk / name, disk / "filler"
            target.write_bytes(_BEFORE)
            filler.write_bytes(bytes(_SIZE - _PAGE * (free + 1)))
            said = ""
            try:
                write(target)
            except DiffractionError as error:
                said = str(error)
            content, left = target.read_bytes(), {p.name for p in disk.iterdir()}
            tried += 1
            if content != (_BEFORE if said else expected[name]) or left != {"filler", name}:
                print(f"{name}, {free} pages free: {len(content)} bytes, {left}, said {said!r}")
            for path in disk.iterdir():
                path.unlink()
    subprocess.run(["umount", str(disk)], check=True)
    print(f"tried {tried}")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
