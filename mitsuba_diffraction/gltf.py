"""glTF files: buffers and pictures come from the file's own folder."""

from __future__ import annotations

import contextlib
import io
import json
import struct
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from PIL import Image

from .errors import DiffractionError, unreadable
from .extras import optional
from .files import GLTF, path_beside, read_bytes, refuse_pipe
from .images import without_programs
from .limits import MOST_PLACED, bounded_memory, check_content, check_count, tree_sizes

# Bytes of a number by the code of its type, and numbers of an item (glTF 2.0, 3.6.2)
_BYTES = {5120: 1, 5121: 1, 5122: 2, 5123: 2, 5125: 4, 5126: 4}
_NUMBERS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}


@dataclass(frozen=True)
class GltfMaterial:
    """Material of a glTF file.

    Attributes
    ----------
    number, name : in the file; triangles without a material have the number after the last.
    metallic, roughness : factors of its surface (glTF 2.0, 3.9.2).
    left_out : names of what else it has, but its base colour.
    """

    number: int
    name: str
    metallic: float
    roughness: float
    left_out: tuple[str, ...]


#: Name of what has no material.
NO_MATERIAL = "none"
#: What a `GltfMaterial` holds, in the document's words.
_HELD = ("name", "pbrMetallicRoughness", "baseColorFactor", "baseColorTexture", "metallicFactor",
         "roughnessFactor", "doubleSided", "extras", "alphaCutoff", "alphaMode")  # fmt: skip

# Compressions of meshes by their extension, and attributes that are read
_COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
_READ = ("POSITION", "NORMAL", "TEXCOORD_0")


def _names(document: dict[str, Any], *kinds: str) -> dict[str, str]:
    """Return the names of the files of a document's items, such as buffers, by their URIs."""
    uris = (str(item.get("uri", "data:")) for kind in kinds for item in document.get(kind, ()))
    return {uri: unquote(uri) for uri in uris if not uri.startswith("data:")}


def named_files(file: Path) -> list[Path]:
    """List the buffers and pictures of a glTF file that lie in its folder; none of other files.

    Readers refuse buffers and pictures that lie elsewhere, and damaged files.
    """
    found: list[Path] = []
    if file.suffix.lower() not in GLTF:
        return found
    with contextlib.suppress(ValueError, LookupError, TypeError, AttributeError):
        for name in _names(_parts(file)[0], "buffers", "images").values():
            with contextlib.suppress(DiffractionError):
                found.append(path_beside(file, name))
    return found


def materials_of(file: Path) -> list[GltfMaterial]:
    """Return the materials of a glTF file's meshes, and `NO_MATERIAL` if there are some without.

    Raises a DiffractionError if the file is damaged.
    """
    with unreadable(f"'{file}' cannot be read as glTF"):
        document, _ = _parts(file)
        primitives = [p for mesh in document.get("meshes", ()) for p in mesh.get("primitives", ())]
        used = {primitive.get("material") for primitive in primitives}
        found, all_materials = [], document.get("materials", [])
        for number, given in enumerate(all_materials):
            if number not in used:
                continue
            surface = given.get("pbrMetallicRoughness", {})
            extensions = given.get("extensions", {})
            present = [*given, *surface, *extensions]
            left = [n for n in present if n not in (*_HELD, "extensions")]
            left += ["alphaMode"] if given.get("alphaMode", "OPAQUE") != "OPAQUE" else []
            metal, rough = (
                float(surface.get(f"{name}Factor", 1.0)) for name in ("metallic", "roughness")
            )
            name = str(given.get("name") or f"material {number}")
            found.append(GltfMaterial(number, name, metal, rough, tuple(left)))
        if None in used:
            found.append(GltfMaterial(len(all_materials), NO_MATERIAL, 0.0, 1.0, ()))
    return found


def load_gltf(file: Path, wanted_by: str, *, materials: bool = False) -> Any:
    """Return a glTF file as a scene of `trimesh`; its pictures are not decoded yet.

    wanted_by : option or parameter that names the file, for the message if `trimesh` is missing.
    materials : keep the materials, for their base colour; otherwise their numbers alone, as names.

    Raises
    ------
    DiffractionError
        If `trimesh` is not installed, a name is a pipe or leads out of the file's folder, or the
        file claims to hold more than it may.
    Exception
        Whatever `trimesh` makes of damaged files.
    """
    trimesh = optional("trimesh", wanted_by)
    document, rest = _parts(file)
    size, buffers = file.stat().st_size, _names(document, "buffers").values()
    held = sum(path_beside(file, name).stat().st_size for name in buffers)
    _check(document, size + held, f"'{file}'")
    _check_encoding(document, f"'{file}'")
    if not materials:  # `trimesh` decodes pictures of some, and keeps UV only beside a material
        document["materials"] = [{} for _ in range(len(document.get("materials", ())) + 1)]
        document.pop("images", None)
        document.pop("textures", None)
        for mesh in document.get("meshes", ()):
            for primitive in mesh.get("primitives", ()):
                primitive.setdefault("material", len(document["materials"]) - 1)
    for number, material in enumerate(document.get("materials", ())):
        material["name"] = str(number)
    # `trimesh` by itself opens pipes, and before 5.0 any file
    beside = {u: path_beside(file, n) for u, n in _names(document, "buffers", "images").items()}
    for path in beside.values():
        refuse_pipe(path)
    contents = {uri: read_bytes(path) for uri, path in beside.items() if path.is_file()}
    content = json.dumps(document).encode()
    if rest is not None:
        content += b" " * (-len(content) % 4)
        head = struct.pack("<4s2I", b"glTF", 2, 20 + len(content) + len(rest))
        content = head + struct.pack("<I4s", len(content), b"JSON") + content + rest
    with without_programs(), bounded_memory(size, f"'{file}'"), warnings.catch_warnings():
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # sizes are checked later
        scene = trimesh.load_scene(
            io.BytesIO(content), file_type=file.suffix[1:].lower(), process=False,
            resolver=contents,
        )  # fmt: skip
    for mesh in scene.geometry.values():
        kept: Any = getattr(mesh.visual, "material", None)
        if not str(getattr(kept, "name", "")).isdecimal():
            continue
        base = document["materials"][int(kept.name)].get("pbrMetallicRoughness", {})
        # `trimesh` leaves out what it cannot read
        if "baseColorTexture" in base and kept.baseColorTexture is None:
            raise DiffractionError(
                f"{wanted_by}: its picture cannot be read, or is too large; save it as PNG"
            )
    return scene


def _parts(file: Path) -> tuple[dict[str, Any], bytes | None]:
    """Return the document of a glTF file, and the chunks after it if the file is binary.

    Raises a ValueError if the file is damaged.
    """
    content, rest = read_bytes(file), None
    if file.suffix.lower() == ".glb":
        magic, _, _, length, kind = struct.unpack_from("<4s3I4s", content.ljust(20))
        if magic != b"glTF" or kind != b"JSON":
            raise ValueError("its first bytes must be a GLB header")
        content, rest = content[20 : 20 + length], content[20 + length :]
    try:
        document = json.loads(content)
    except RecursionError as error:
        raise ValueError("its document nests too much") from error
    if not isinstance(document, dict):
        raise ValueError("its document must be an object")
    return document, rest


def _check_encoding(document: dict[str, Any], shown: str) -> None:
    """Refuse meshes that `trimesh` does not read, or reads as other numbers.

    Integers that stand for fractions (`normalized`: glTF 2.0, 3.6.2) are read as integers.
    """
    required = set(document.get("extensionsRequired", ()))
    for name, encoding in _COMPRESSED.items():
        if name in required:
            raise DiffractionError(
                f"{shown}: its meshes are compressed by {encoding} ({name}), which is not read; "
                "import it into Blender and export it as glTF with Compression off, or save it "
                "as PLY, OBJ or USD"
            )
    accessors = document.get("accessors", [])
    for mesh in document.get("meshes", ()):
        for primitive in mesh.get("primitives", ()):
            for name, number in primitive.get("attributes", {}).items():
                if name in _READ and accessors[number].get("normalized", False):
                    raise DiffractionError(
                        f"{shown}: its {name} are integers that stand for fractions (quantized), "
                        "which are not read; export it without quantization, as floating-point "
                        "numbers"
                    )


def _check(document: dict[str, Any], size: int, shown: str) -> None:
    """Refuse numbers, parts of buffers and placed meshes that are more than a file may hold."""
    nodes = document.get("nodes", [])
    check_count(len(nodes), MOST_PLACED, shown, "nodes")
    placed = max(tree_sizes([node.get("children", []) for node in nodes]), default=0.0)
    check_count(placed, MOST_PLACED, shown, "nodes below one")
    claimed = sum(float(view["byteLength"]) for view in document.get("bufferViews", []))
    for accessor in document.get("accessors", []):
        item = _BYTES[accessor["componentType"]] * _NUMBERS[accessor["type"]]
        claimed += float(accessor["count"]) * item
    check_content(claimed, size, shown)
