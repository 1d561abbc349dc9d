"""Small files that ask for all memory, all day, or an address that does not exist.

`python -m tests.support.small_scenes FOLDER NAME ...` writes and reads files in one process, and
prints a line of JSON for each: the refusal, seconds, and the peak memory of the process so far.
"""

from __future__ import annotations

import importlib.util
import json
import struct
import sys
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple


class Hostile(NamedTuple):
    """A hostile file: how it is written into a folder, and what reads it."""

    write: Callable[[Path], Path]
    read: Callable[[Path], object]


FILES: dict[str, Hostile] = {}


def hostile(
    name: str, read: Callable[[Path], object], needs: str = ""
) -> Callable[..., Callable[[Path], None]]:
    """Register the function that writes the file `name`, if the package that reads it is there."""

    def register(write: Callable[[Path], None]) -> Callable[[Path], None]:
        def written(folder: Path) -> Path:
            path = folder / name
            write(path)
            return path

        assert name not in FILES
        if not needs or importlib.util.find_spec(needs) is not None:
            FILES[name] = Hostile(written, read)
        return write

    return register


def small(
    name: str, read: Callable[[Path], object], content: Callable[[], str | bytes], needs: str = ""
) -> None:
    """Register the file `name` of this content."""

    @hostile(name, read, needs)
    def write(path: Path) -> None:
        made = content()
        path.write_bytes(made if isinstance(made, bytes) else made.encode())


# --- readers -------------------------------------------------------------------------------------
def heights(path: Path) -> object:
    import mitsuba_diffraction as md

    return md.HeightField.load(path, pixel_size=0.05, max_height=0.3)


def mesh(path: Path) -> object:
    from mitsuba_diffraction.scene.orientation import load_mesh

    return load_mesh(path)


def scene(path: Path) -> object:
    from mitsuba_diffraction.scene import load_scene

    return load_scene(path, {})


def solved_layers(path: Path) -> object:
    from mitsuba_diffraction.orders.solve import read_layers

    return read_layers(path)


def zeros(count: int) -> bytes:
    """Return `count` zeros, deflated: a block of 16 MiB and what repeats it."""
    block, end = (zlib.compressobj(9, wbits=-15) for _ in range(2))
    whole, rest = divmod(count, 1 << 24)
    packed = block.compress(bytes(1 << 24)) + block.flush(zlib.Z_FULL_FLUSH)
    return packed * whole + end.compress(bytes(rest)) + end.flush()


def png(width: int, height: int, bits: int = 8, channels: int = 1) -> bytes:
    """Return a PNG of zeros, whose checksum is wrong: nobody may come so far."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        checksum = struct.pack(">I", zlib.crc32(kind + data))
        return struct.pack(">I", len(data)) + kind + data + checksum

    data = b"\x78\x9c" + zeros(height * (1 + (width * bits * channels + 7) // 8)) + bytes(4)
    head = struct.pack(">IIBBBBB", width, height, bits, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


# --- heights -------------------------------------------------------------------------------------
def archive(*members: tuple[str, int, int]) -> bytes:
    """Return a ZIP archive of members of zeros: name, bytes, and bytes that the directory states.

    Written by hand, since deflating gigabytes takes minutes.
    """
    content = directory = b""
    for name, size, stated in members:
        data = zeros(size)
        head = struct.pack("<5H3I2H", 20, 0, 8, 0, 0x21, 0, len(data), stated, len(name), 0)
        rest = struct.pack("<3H2I", 0, 0, 0, 0, len(content))
        directory += b"PK\x01\x02" + struct.pack("<H", 20) + head + rest + name.encode()
        content += b"PK\x03\x04" + head + name.encode() + data
    count = len(members)
    end = struct.pack("<4H2IH", 0, 0, count, count, len(directory), len(content), 0)
    return content + directory + b"PK\x05\x06" + end


small("bomb.x3p", heights, lambda: archive(("main.xml", 1 << 31, 1 << 31)))
small("text.x3p", heights, lambda: archive(("main.xml", 1 << 28, 1 << 28)))
small("lying.x3p", heights, lambda: archive(("main.xml", 1 << 31, 10)), "SurfaceTopography")
small(
    "bomb.plux",
    heights,
    lambda: archive(("index.xml", 1 << 24, 1 << 24), ("LAYER_0.raw", 1 << 31, 1 << 31)),
)
small(
    "nmm.zip",
    heights,
    lambda: archive(("s.dsc", 1 << 20, 1 << 20), ("s_1_1.dat", 1 << 31, 1 << 31)),
)
small("zeros.npz", heights, lambda: archive(("a.npy", 1 << 31, 1 << 31)))
small("zeros.png", heights, lambda: png(12_000, 12_000))
small("long_line.csv", heights, lambda: "1," * 2_500_000)
small("long_cell.csv", heights, lambda: "1" * 5_000_000)
small("long_line.dat", heights, lambda: "1 " * 4_000_000)
LAYERS = "repeat = 1000\nlayers = [" + '["1.3", 0.001],' * 60_000 + "]\n"
small("solved_layers.toml", solved_layers, lambda: LAYERS)
small("dots.toml", heights, lambda: "a." * 490_000 + "b = 1\n")
small("sources.toml", heights, lambda: "source = [" + '"a",' * 240_000 + "]\n")


@hostile("seeds.toml", heights)
def _(path: Path) -> None:
    seeds = ",".join(map(str, range(140_000)))
    path.write_text(f'generator = "brushed"\nseeds = [{seeds}]\n[arguments]\n')


def run(names: list[str], folder: Path) -> None:
    """Write and read files; print what is said of each."""
    from mitsuba_diffraction.errors import DiffractionError
    from mitsuba_diffraction.scene import set_variant
    from mitsuba_diffraction.system import peak_memory

    set_variant("scalar_rgb")
    for name in names:
        path = FILES[name].write(folder)
        print(name, file=sys.stderr, flush=True)
        start, refusal = time.monotonic(), None
        try:
            FILES[name].read(path)
        except DiffractionError as error:
            refusal = str(error)
        print(
            json.dumps({
                "name": name, "seconds": time.monotonic() - start, "peak": peak_memory(),
                "refusal": refusal, "size": path.stat().st_size,
            }),
            flush=True,
        )  # fmt: skip
