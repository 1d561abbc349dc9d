"""What a clone's folder holds, with patches and pictures so small that what runs there is quick."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from scenes.make.__main__ import main as make_mesh
from tests.support import ROOT
from tests.support.orders import thin_grating

#: One patch for all scenes, whose table is made once.
SMALL = {"resx": "12", "resy": "10", "patch": "../precompute/elaphe_like.toml"}
#: Meshes for which one coarse snake stands.
SNAKES = ("elaphe", "xenopeltis")
#: Tables of solved orders that are large, for which finer grooves with fewer orders stand.
GRATINGS: dict[str, dict[str, Any]] = {
    "blazed": {}, "cd": {"superstrate": 1.58}, "dvd": {"superstrate": 1.58}, "sinusoidal": {},
    "spectrometer": {"thin": True},
}  # fmt: skip


def small_clone(folder: Path) -> Path:
    """Scenes, their meshes and textures, and recipes; `folder` again."""
    meshes = folder / "scenes" / "meshes"
    meshes.mkdir(parents=True)
    (folder / "scenes" / "textures").symlink_to(ROOT / "scenes" / "textures")
    for mesh in (ROOT / "scenes" / "meshes").glob("*.ply"):
        if mesh.stem not in SNAKES:
            (meshes / mesh.name).symlink_to(mesh)
    # a fifth of the triangles
    coarse = ["--detail", "1", "--head-detail", "12"]
    assert make_mesh(["snake", "-o", str(meshes / f"{SNAKES[0]}.ply"), *coarse]) == 0
    for name in SNAKES[1:]:
        (meshes / f"{name}.ply").symlink_to(meshes / f"{SNAKES[0]}.ply")
    for scene in (ROOT / "scenes").glob("*.xml"):
        text = scene.read_text(encoding="utf-8")
        for name, value in SMALL.items():
            text = re.sub(f'(<default name="{name}" value=)"[^"]*"', rf'\1"{value}"', text)
        (folder / "scenes" / scene.name).write_text(text, encoding="utf-8")
    (folder / "precompute" / "looks").mkdir(parents=True)
    (folder / "precompute" / "orders").mkdir()
    for table in ROOT.glob("precompute/orders/*.nc"):
        if table.stem in GRATINGS:
            thin_grating(0.5, **GRATINGS[table.stem]).save(folder / table.relative_to(ROOT))
        else:
            (folder / table.relative_to(ROOT)).symlink_to(table)
    for recipe in [*ROOT.glob("precompute/*.toml"), *ROOT.glob("precompute/looks/*.toml")]:
        text = recipe.read_text(encoding="utf-8")
        if recipe.stem.endswith("_like"):  # a coarser and smaller patch of its kind
            text = re.sub(r"extent = .*", "extent = 4.0", text)
            text = re.sub(r"pixels = .*", "pixels = 80", text)
            text = f"coherence_width = 4.0\n{text}"
        elif recipe.parent.name == "looks":  # coarser
            text = re.sub(r"pixels = .*\n", "", text)
            text = f"coherence_width = 16.0\n{text}pixels = 160\n"
        elif recipe.stem == "blazed":
            text = f"{text}periods = 4\nrows = 16\n"
        (folder / recipe.relative_to(ROOT)).write_text(text, encoding="utf-8")
    return folder
