"""Materials of a .blend file: a folder's own are rebuilt, and those of other folders stay."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from mitsuba_diffraction.osl.blender_material import own_data


class Blocks:
    """Data blocks as Blender has them: unique names, custom properties."""

    def __init__(self) -> None:
        self.blocks: list[Any] = []

    def __iter__(self) -> Iterator[Any]:
        return iter(self.blocks)

    def new(self, name: str) -> Any:
        self.blocks.append({"shown": name if not self.blocks else f"{name}.{len(self.blocks):03}"})
        return self.blocks[-1]


@pytest.fixture
def shaders(tmp_path):
    files = [tmp_path / folder / "scale.osl" for folder in ("gold", "skin")]
    for file in files:
        file.parent.mkdir()
        file.touch()
    return files


def test_materials_of_two_folders_coexist(shaders):
    blocks = Blocks()
    gold, skin = (own_data(blocks, "scale", shader) for shader in shaders)
    assert [block["shown"] for block in blocks] == ["scale", "scale.001"]
    assert own_data(blocks, "scale", shaders[0]) is gold
    assert own_data(blocks, "scale", shaders[1]) is skin
    assert own_data(blocks, "worn scale", shaders[0]) not in (gold, skin)


def test_a_moved_folder_rebuilds_its_material(shaders):
    blocks = Blocks()
    made = own_data(blocks, "scale", shaders[0])
    moved = shaders[0].parent.rename(shaders[0].parent.with_name("moved")) / shaders[0].name
    assert own_data(blocks, "scale", moved) is made
    assert own_data(blocks, "scale", moved) is made
    assert len(blocks.blocks) == 1


def test_a_users_material_of_that_name_stays(shaders):
    blocks = Blocks()
    users = blocks.new("scale")
    assert own_data(blocks, "scale", shaders[0]) is not users
    assert users == {"shown": "scale"}
