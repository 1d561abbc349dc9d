"""Small files that ask for all memory, all day, or an address that does not exist.

`python -m tests.support.small_files FOLDER NAME ...` writes and reads files in one process, and
prints a line of JSON for each: the refusal, seconds, and the peak memory of the process so far.
"""

from __future__ import annotations

import base64
import importlib.util
import json
import struct
import sys
import time
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np


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


# --- meshes --------------------------------------------------------------------------------------
def _ply(vertices: int, faces: str, body: bytes, count: int) -> bytes:
    header = (
        f"ply\nformat binary_little_endian 1.0\nelement vertex {vertices}\nproperty float x\n"
        f"property float y\nproperty float z\nelement face {count}\n{faces}end_header\n"
    )
    return header.encode() + body


_LIST = "property list uchar int vertex_indices\n"
_XYZ = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)


def _to(index: int) -> bytes:
    """A triangle of vertices 0, 1 and this one."""
    return struct.pack("<B3i", 3, 0, 1, index)


small("index.ply", mesh, lambda: _ply(3, _LIST, _XYZ + _to(400_000_000), 1))


def scene_of(body: str) -> str:
    return f'<scene version="3.0.0">{body}</scene>'


def _shape(kind: str, file: str) -> str:
    return scene_of(f'<shape type="{kind}"><string name="filename" value="{file}"/></shape>')


def shaped(name: str, kind: str, content: Callable[[], str | bytes]) -> None:
    """Register a scene with one shape, whose mesh has this content."""

    @hostile(name, scene)
    def write(path: Path) -> None:
        made, file = content(), path.with_suffix(f".{kind}")
        file.write_bytes(made if isinstance(made, bytes) else made.encode())
        path.write_text(_shape(kind, file.name))


shaped("index_ply.xml", "ply", lambda: _ply(3, _LIST, _XYZ + _to(400_000_000), 1))
shaped("negative_ply.xml", "ply", lambda: _ply(3, _LIST, _XYZ + _to(-1), 1))


def serialized(index: int, vertices: int = 3) -> bytes:
    """A mesh of Mitsuba's own format (version 4), single precision."""
    content = struct.pack("<I", 0x1000) + b"mesh\0" + struct.pack("<QQ", vertices, 1)
    content += _XYZ + struct.pack("<3I", 0, 1, index)
    packed = struct.pack("<HH", 0x041C, 4) + zlib.compress(content)
    return packed + struct.pack("<QI", 0, 1)


shaped("index_serialized.xml", "serialized", lambda: serialized(400_000_000))
shaped("count_serialized.xml", "serialized", lambda: serialized(2, vertices=300_000_000))
shaped("count_ply.xml", "ply", lambda: _ply(400_000_000, _LIST, _XYZ + _to(2), 1))
shaped("faces_ply.xml", "ply", lambda: _ply(3, _LIST, _XYZ + _to(2), 400_000_000))
small("no_properties.ply", mesh, lambda: _ply(3, "", _XYZ, 2_000_000_000))
small(
    "no_properties_vertex.ply",
    mesh,
    lambda: (
        b"ply\nformat binary_little_endian 1.0\nelement vertex 2000000000\n"
        b"element face 1\n" + _LIST.encode() + b"end_header\n" + _to(2)
    ),
)
small(
    "other_list.ply",
    mesh,
    lambda: _ply(3, "property list uchar int flags\n", _XYZ + bytes(10), 2_000_000_000),
)
shaped("obj_index.xml", "obj", lambda: "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 400000000\n")
shaped("obj_negative.xml", "obj", lambda: "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -400000000\n")
shaped("obj_uv.xml", "obj", lambda: "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/9 2/1 3/400000000\n")
shaped(
    "obj_zero.xml",
    "obj",
    lambda: "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 0 1 2\nf 1/0/0 2/0/0 3/0/0\n",
)


def gltf(**changes: object) -> dict[str, object]:
    """A triangle."""
    data = _XYZ + struct.pack("<3H", 0, 1, 2)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "buffers": [{"uri": uri, "byteLength": len(data)}],
        "bufferViews": [{"buffer": 0, "byteLength": 36},
                        {"buffer": 0, "byteOffset": 36, "byteLength": 6}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
        ], **changes,
    }  # fmt: skip


@hostile("accessor.gltf", mesh, "trimesh")
def _(path: Path) -> None:
    document = gltf(accessors=[
        {"componentType": 5126, "count": 400_000_000, "type": "VEC3"},
        {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
    ])  # fmt: skip
    path.write_text(json.dumps(document))


@hostile("accessor_sparse.gltf", mesh, "trimesh")
def _(path: Path) -> None:
    document = gltf(accessors=[
        {"componentType": 5126, "count": 400_000_000, "type": "VEC3", "sparse": {
            "count": 1, "indices": {"bufferView": 1, "componentType": 5123},
            "values": {"bufferView": 0}}},
        {"bufferView": 1, "componentType": 5123, "count": 3, "type": "SCALAR"},
    ])  # fmt: skip
    path.write_text(json.dumps(document))


@hostile("instances.gltf", mesh, "trimesh")
def _(path: Path) -> None:
    document = gltf(nodes=[{"mesh": 0}] * 300_000, scenes=[{"nodes": list(range(300_000))}])
    path.write_text(json.dumps(document))


def _with_picture(data: bytes) -> dict[str, object]:
    uri = "data:image/png;base64," + base64.b64encode(data).decode()
    return gltf(
        images=[{"uri": uri}], textures=[{"source": 0}],
        materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
        meshes=[{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
    )  # fmt: skip


small(
    "circle.gltf", mesh, lambda: json.dumps(gltf(nodes=[{"mesh": 0, "children": [0]}])), "trimesh"
)


@hostile("tree.gltf", mesh, "trimesh")
def _(path: Path) -> None:
    nodes = [{"children": [n + 1, n + 1]} for n in range(40)]
    path.write_text(json.dumps(gltf(nodes=[*nodes, {"mesh": 0}])))


@hostile("views.gltf", mesh, "trimesh")
def _(path: Path) -> None:
    document = gltf()
    document["buffers"] = [{"uri": "views.bin", "byteLength": 1 << 24}]
    document["bufferViews"] = [{"buffer": 0, "byteLength": 1 << 24}] * 10_000
    path.with_suffix(".bin").write_bytes(_XYZ.ljust(1 << 24, b"\0"))
    path.write_text(json.dumps(document))


_USD = """#usda 1.0
def Mesh "m"
{
    int[] faceVertexCounts = [%s]
    int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
}
"""


small("count.usda", mesh, lambda: _USD % "2000000000", "pxr")


# --- surfaces ------------------------------------------------------------------------------------
def surfaced(parameter: str, file: str, content: Callable[[], str], needs: str = "") -> None:
    """Register a scene with a flat surface, one parameter of which is a file of this content."""

    @hostile(f"{parameter}.xml", scene, needs)
    def write(path: Path) -> None:
        (path.parent / file).write_text(content())
        np.save(path.parent / "flat.npy", np.zeros((8, 8)))
        path.write_text(scene_of(
            '<shape type="sphere"><bsdf type="diffraction"><string name="filename" '
            'value="flat.npy"/><float name="pixel_size" value="1"/>'
            f'<string name="{parameter}" value="{path.parent / file}"/></bsdf></shape>'
        ))  # fmt: skip


surfaced("layers", "layers.toml", lambda: LAYERS)
surfaced(
    "pigment", "a.gltf", lambda: json.dumps(_with_picture(png(13_000, 13_000, 8, 4))), "trimesh"
)
# --- scenes --------------------------------------------------------------------------------------
small("deep.xml", scene, lambda: scene_of('<bsdf type="twosided">' * 8000 + "</bsdf>" * 8000))
small(
    "deeper.xml", scene, lambda: scene_of('<bsdf type="twosided">' * 200_000 + "</bsdf>" * 200_000)
)


@hostile("entities.xml", scene)
def _(path: Path) -> None:
    entities = '<!ENTITY a0 "aaaaaaaaaa">' + "".join(
        f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 10)
    )
    path.write_text(f"<!DOCTYPE scene [{entities}]>" + scene_of('<bsdf type="diffuse" id="&a9;"/>'))


@hostile("includes.xml", scene)
def _(path: Path) -> None:
    for n in range(12):
        following = f"includes{n + 1}.xml"
        (path.parent / f"includes{n}.xml").write_text(
            scene_of(f'<include filename="{following}"/>' * 4)
        )
    (path.parent / "includes12.xml").write_text(scene_of(""))
    path.write_text(scene_of('<include filename="includes0.xml"/>'))


small("itself.xml", scene, lambda: scene_of('<include filename="itself.xml"/>' * 4))


@hostile("references.xml", scene)
def _(path: Path) -> None:
    bsdfs = '<bsdf type="diffuse" id="b0"/>' + "".join(
        f'<bsdf type="blendbsdf" id="b{n}"><float name="weight" value="0.5"/>'
        f'<ref id="b{n - 1}"/><ref id="b{n - 1}"/></bsdf>'
        for n in range(1, 21)
    )
    path.write_text(scene_of(bsdfs + '<shape type="sphere"><ref id="b20"/></shape>'))


@hostile("picture.xml", scene)
def _(path: Path) -> None:
    (path.parent / "picture.png").write_bytes(png(30_000, 30_000))
    path.write_text(scene_of(
        '<shape type="sphere"><bsdf type="diffuse"><texture type="bitmap" name="reflectance">'
        '<string name="filename" value="picture.png"/></texture></bsdf></shape>'
    ))  # fmt: skip


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


if __name__ == "__main__":
    run(sys.argv[2:], Path(sys.argv[1]))
