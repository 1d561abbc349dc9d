"""The studio of `scenes/own_mesh.xml`, for meshes that are rendered without a scene."""

from __future__ import annotations

from pathlib import Path

#: Scene that meshes are put into.
STUDIO = Path(__file__).with_name("own_mesh.xml")
#: Suffixes of mesh files that Mitsuba reads.
MESHES = (".ply", ".obj", ".serialized")
#: Suffixes of mesh files that have to be converted first: Mitsuba reads neither STL nor glTF.
OTHER_MESHES = (".stl", ".glb", ".gltf", ".fbx", ".dae", ".3ds", ".3mf", ".off", ".blend")
