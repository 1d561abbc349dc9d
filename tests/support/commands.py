"""Commands that pages show, run on small patches and pictures."""

from __future__ import annotations

import contextlib
import gc
import re
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

import mitsuba_diffraction as md
from mitsuba_diffraction.cli import main
from mitsuba_diffraction.plugin.presets import PATCHES, find_preset
from scenes.make.__main__ import main as make_mesh
from tests.support import ROOT, crossed
from tests.support.coarse import little_light
from tests.support.instruments import nanoscope
from tests.support.logos import drawn, write_board, write_boxes
from tests.support.orders import thin_grating
from tests.support.pages import blocks, spans, typed
from tests.support.scenes import searched

NOT_RUN = {"view", "tradeoff", "compare", "plan", "--plan", "--crossed"}
# one wavelength stands for all, and few points do
_PERFECT = ["--material", "none"]
_NARROW = ["--wavelength-range", "590:610"]
# as small as commands may be asked to be; the last option of a name counts
SMALL = {
    "render": ["-s", "2", "-m", "scalar_spectral"],
    "brdf-map": ["--resolution", "24", "--step", "50", "--samples", "1"],
    "evaluate": ["--step", "50", "--angle-step", "2", "--positions", "2", "--coherence-width=10"],
    "solve": ["--period", "0.25", "--resolution", "64", "--tolerance", "0.2", *_NARROW],
    "sweep": ["--coherence-width", "10", "--resolution", "12"],
    "export-bsdf": ["--theta", "0,40", "--phi", "0,180", "--resolution", "8"],
    "export-viewer": ["--method", "exact"],
    "export-shader": ["--coherence-width", "4", "--tolerance", "0.05"],
    "survey": ["--coherence-width", "4", "--tolerance", "0.05", "--resolution", "16"],
}


#: A mesh that stands on one of its faces.
_WEDGE = """v 0 0 0
v 2 0 0
v 2 0 1
v 0 0 1
v 1 1 0.5
f 1 2 5
f 2 3 5
f 3 4 5
f 4 1 5
f 4 3 2
f 4 2 1
"""


def commands(page: str) -> list[list[str]]:
    """Words of a page's commands that are run here: those of blocks, then those of sentences."""
    lines = [words for text in blocks(page, "sh") for words in typed(text)]
    lines += [words for span in spans(page) for words in typed(span) if len(words) > 2]
    # FILE and TABLE stand for what the reader has
    lines = [words for words in lines if not any(w.isalpha() and w.isupper() for w in words)]
    return [
        words
        for words in lines
        if (Path(words[0]).name == "mitsuba-diffraction" and NOT_RUN.isdisjoint(words))
        or (words[1:3] == ["-m", "scenes.make"] and len(words) > 4)
    ]


def run(words: list[str]) -> None:
    """Run a command, smaller than it stands there."""
    gc.collect()  # as in a process of its own, without the BSDFs of the command before
    if words[1] == "-m":
        coarse = ["--detail", "1"] if "snake" in words else []
        assert make_mesh([*words[3:], *coarse]) == 0
        return
    _, command, *rest = words
    rest = [word.replace("$PWD", str(Path.cwd())) for word in rest]
    rest = [*without_size(rest), *_smaller(command, rest)]
    # need extras, and have tests of their own
    rest = [word.replace(".mp4", ".webp") for word in rest if word != "--denoise"]
    for option in {"--workers", "--jobs"} & set(rest):  # tests/cluster starts processes
        at = rest.index(option)
        del rest[at : at + 2]
    if command == "render" and (not rest[0].endswith(".xml") or "label" in rest[0]):  # large stages
        rest += ["-D", "resx=12", "-D", "resy=10"]
    if "--preset" in rest:
        at = rest.index("--preset") + 1
        rest[at] = small_look(command, rest[at])
    if "--addon" in rest and "--with" not in rest:  # all presets take minutes
        rest += ["--with", "cd-osl"]
    if command == "render" and {"--frames", "--orbit"} & set(rest):
        rest += ["--frames", "2"]
    assert main([command, *rest]) == 0, words
    if "-o" in rest:
        output = Path(rest[rest.index("-o") + 1])
        assert output.stat().st_size > 0
        if command == "render" and output.suffix != ".webp":
            with Image.open(output.with_suffix(".png")) as picture:
                # shown as it is: neither black nor burnt out; lamps in the dark are few pixels
                grey = np.asarray(picture.convert("L"))
                assert np.percentile(grey, 95) > 20
                assert np.median(grey) < 235


def _smaller(command: str, rest: list[str]) -> list[str]:
    """Return what makes a command small."""
    if "--import" in rest or (command == "export-shader" and rest[0].endswith(".nc")):
        return []  # as small as its file
    if any(word.startswith("--theta") for word in rest) and command == "solve":
        few = ["--wavelength-range", "550:550"]
        if "." not in rest[0]:  # of a solver's work, the least: shallow grooves
            few += ["--period", "0.6", "--depth", "0.03", "--resolution", "48"]
        if "." not in rest[0] and not {"--layer", "--beneath"} & set(rest):
            few += _PERFECT
        return few
    small = SMALL.get(command, [])
    if command == "export-bsdf" and "--wavelength" not in rest:
        return [*small, "--wavelength", "500,600"]
    if "--block" in rest:  # by coupled waves
        return [*small, "--resolution", "10"]
    if "--thin" in rest:
        return [*small, "--resolution", "32"]
    return [*_PERFECT, *small] if command == "solve" else small  # others let light through


def small_look(command: str, value: str) -> str:
    """Value of --preset with a small patch: the tree's of that name, or a look of one period."""
    look = find_preset(value.partition(",")[0].rpartition("=")[2])
    if command in ("brdf-map", "export-osl"):  # which take no parameters behind the name
        return "gold-foil"
    return f"{value},filename={Path('precompute', look.patch.relative_to(PATCHES)).absolute()}"


def without_size(rest: list[str]) -> list[str]:
    """Arguments without -D resx=... and -D resy=..., larger than scenes are here."""
    sized = {i for i, word in enumerate(rest) if word.startswith(("resx=", "resy="))}
    return [word for i, word in enumerate(rest) if not {i, i + 1} & sized]


def small_tree(folder: Path) -> Path:
    """What a clone's folder holds, and the files that commands name, small."""
    small_clone(folder)
    (folder / "out").mkdir()
    field = md.gratings.sinusoidal(period=1.6, depth=0.05, periods=4, rows=32)
    heights = np.tile(field.heights[:1], (32, 1))
    np.save(folder / "grating.npy", heights)
    grey = np.round((heights - heights.min()) / np.ptp(heights) * 255).astype(np.uint8)
    for name in ("scans", "snakes", "other"):
        (folder / name).mkdir()
    for name in ("scale.png", "elaphe.png", "a.png", "b.png", "scans/scale_1.png"):
        Image.fromarray(grey).save(folder / name)
    quick = {"coherence_width": 4.0, "tolerance": 0.05}
    md.DiffractionTable.build(field, **quick).save(folder / "scale.exr")
    # 32 lines of 64 samples, 8 by 4 µm, 3.9 nm high
    wave = 512 * np.sin(2 * np.pi * np.arange(64) / 16)
    counts = np.tile(np.int16(np.round(wave)), (32, 1))
    (folder / "scan.spm").write_bytes(nanoscope(counts, scan_size="8 4 ~m"))
    for name in ("snakes/snake_1.spm", "other/b.spm"):
        shutil.copy(folder / "scan.spm", folder / name)
    assert make_mesh(["knot", "-o", str(folder / "mesh.ply")]) == 0
    (folder / "cow.obj").write_text(_WEDGE, "utf-8")
    Image.fromarray(grey).save(folder / "cow.png")
    write_boxes(folder / "car.glb", "Paint", "Glass")
    mi.Bitmap(np.full((4, 8, 3), 0.4, np.float32)).write(str(folder / "sky.hdr"))
    (folder / "skin-osl").symlink_to("cd-osl")  # which a command before exports
    drawn(32, 1).save(folder / "logo.png")
    write_board(folder / "bottle.obj")
    (folder / "r2.csv").write_text("0,0\n2.5316,5.0633\n", "utf-8")
    rough = (
        'generator = "rough"\n[arguments]\nextent = 8.0\npixels = 40\nrms = 0.003\nslope = 1.0\n'
    )
    (folder / "polished.toml").write_text(rough, "utf-8")
    (folder / "mirror.toml").write_text('layers = [["SiO2", 0.1], ["1.95", 0.07]]', "utf-8")
    # efficiencies as the page's programs write them
    with contextlib.chdir(folder):
        for program in blocks("docs/orders.md", "python"):
            if "mine.csv" in program:
                exec(program, {})
    # tables and recipes of commands that are left out here
    crossed.table().save(folder / "lumps.nc")
    shutil.copy(folder / "precompute" / "elaphe_like.toml", folder / "snake.toml")
    return folder


def run_page(page: str, tree: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run a page's commands in a folder of `small_tree`."""
    little_light(monkeypatch.setattr)
    # a process for each `solve` would take longer to start than to solve
    monkeypatch.setattr("mitsuba_diffraction.orders.solve.jobs.processes", ThreadPoolExecutor)
    # half of the work of small tables
    monkeypatch.setattr("mitsuba_diffraction.orders.solve.accuracy.SAMPLES", 16)
    monkeypatch.chdir(tree)
    # as in a process of its own: Mitsuba looks for files where it was imported
    with searched(tree):
        for words in commands(page):
            run(words)


#: One patch for all scenes, whose table is made once.
SMALLER_SCENES = {"resx": "12", "resy": "10", "patch": "../precompute/elaphe_like.toml"}
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
        for name, value in SMALLER_SCENES.items():
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
