"""Small meshes and scenes that ask for more than there is; see `small_files`."""

from __future__ import annotations

import json
import struct
import sys
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tests.support.small_files import FILES, LAYERS, hostile, mesh, png, run, scene, small

__all__ = ["FILES"]


# --- meshes --------------------------------------------------------------------------------------
def _ply(vertices: int, faces: str, body: bytes, count: int, form: str = "binary_little_endian"):
    header = (
        f"ply\nformat {form} 1.0\nelement vertex {vertices}\nproperty float x\nproperty float y\n"
        f"property float z\nelement face {count}\n{faces}end_header\n"
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


def serialized(index: int, vertices: int = 3, faces: int = 1, cut: int | None = None) -> bytes:
    """A mesh of Mitsuba's own format (version 4), single precision."""
    content = struct.pack("<I", 0x1000) + b"mesh\0" + struct.pack("<QQ", vertices, faces)
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
    import base64

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
    import base64

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


if __name__ == "__main__":
    run(sys.argv[2:], Path(sys.argv[1]))
