"""`render --frames` and `--preview`: the frames asked for, kept by the next run, and a film."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from mitsuba_diffraction.scene.frames import write_film
from mitsuba_diffraction.scene.parameters import change_of, values_of_frames

# A uniform sky alone: every pixel is as bright as `light` says.
SCENE = """<scene version="3.5.0">
  <default name="spp" value="2"/>
  <default name="light" value="0.1"/>
  <default name="around" value="30"/>
  <default name="text" value="word"/>
  <integrator type="path"/>
  <sensor type="perspective">
    <transform name="to_world"><rotate z="1" angle="$around"/></transform>
    <film type="hdrfilm">
      <integer name="width" value="16"/><integer name="height" value="10"/>
    </film>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
  </sensor>
  <emitter type="constant"><rgb name="radiance" value="$light"/></emitter>
</scene>
"""
LIGHT = ("--animate", "light=0:0.4")


@pytest.fixture
def render(run, scene):
    """`render(*options)`: frames of the scene, quickly."""
    return lambda *options: run(
        "render", scene, "-m", "scalar_rgb", "--tonemap", "standard", *options
    )


def brightness(path):
    """Linear value of the first pixel of a PNG (IEC 61966-2-1)."""
    with Image.open(path) as image:
        encoded = np.asarray(image)[0, 0, 0] / 255
    return encoded / 12.92 if encoded < 0.04045 else ((encoded + 0.055) / 1.055) ** 2.4


def test_a_parameter_goes_from_its_first_value_to_its_last(render):
    ran = render("--frames", "3", *LIGHT, "-o", "out").succeeded()
    assert ran.out.startswith("out: 3 frames, 3 of them new, ")
    assert sorted(os.listdir("out")) == [f"frame_000{n}.png" for n in range(3)]
    found = [brightness(f"out/frame_000{n}.png") for n in range(3)]
    # eight bits of sRGB, dithered: a step at 0.4 is 0.006
    np.testing.assert_allclose(found, [0, 0.2, 0.4], atol=0.01)


def test_a_turn_begins_at_the_scenes_value_and_ends_a_step_before(scene):
    frames = values_of_frames(scene, {}, 4, [], ["around"])
    assert [frame["around"] for frame in frames] == ["30", "120", "210", "300"]
    frames = values_of_frames(scene, {"around": "-10", "spp": "1"}, 2, [], ["around"])
    assert frames == [{"around": "-10", "spp": "1"}, {"around": "170", "spp": "1"}]


def test_lists_change_number_by_number(scene):
    frames = values_of_frames(scene, {}, 3, [change_of("place=0,-9,3:4,-9,2")], [])
    assert [frame["place"] for frame in frames] == ["0, -9, 3", "2, -9, 2.5", "4, -9, 2"]
    assert values_of_frames(scene, {}, 1, [change_of("a=1e-3:2")], []) == [{"a": "0.001"}]


def test_frames_that_are_there_are_kept(render):
    assert render("--frames", "3", *LIGHT).code == 0
    folder = "room_frames"
    before = {name: os.stat(f"{folder}/{name}").st_mtime_ns for name in os.listdir(folder)}
    os.remove(f"{folder}/frame_0001.png")
    ran = render("--frames", "3", *LIGHT, "--json", "a.json")
    report = json.loads(Path("a.json").read_text(encoding="utf-8"))
    assert (report["frames"], report["new"], len(report["files"])) == (3, 1, 3)
    assert ran.code == 0
    assert ran.err == "mitsuba-diffraction: 2 of 3 frames are up to date\n"
    assert "3 frames, 1 of them new" in ran.out
    for name in ("frame_0000.png", "frame_0002.png"):
        assert os.stat(f"{folder}/{name}").st_mtime_ns == before[name]
    assert "0 of them new" in render("--frames", "3", *LIGHT).out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["-s", "1"], "frames are rendered again because of their samples: of frame_0000.png it "
         "was the scene's and is 1"),
        (["-D", "around=7"], "their -D around: of frame_0000.png it was None and is 7"),
        (["--exposure", "1"], "their exposure"),
        (["--tonemap", "natural"], "their view"),
        (["--exr"], "their EXR: of frame_0000.png it is missing"),
        (["--preview"], "their preview"),
    ],
)  # fmt: skip
def test_frames_of_other_settings_are_made_anew_and_it_says_why(render, options, said):
    assert render("--frames", "2", *LIGHT).code == 0
    ran = render("--frames", "2", *LIGHT, *options)
    assert said in ran.err
    assert "2 frames, 2 of them new" in ran.out


def test_a_change_of_the_scene_or_of_what_it_names_is_noticed(render, scene):
    named = scene.parent / "inner.xml"
    named.write_text('<scene version="3.0.0"/>')
    scene.write_text(SCENE.replace("</scene>", '<include filename="inner.xml"/></scene>'))
    assert render("--frames", "2", *LIGHT).code == 0
    named.write_text('<scene version="3.0.0"><emitter type="constant"/></scene>'.replace(
        '<emitter type="constant"/>', '<default name="a" value="1"/>'))  # fmt: skip
    assert (
        "rendered again because of their scene: of frame_0000.png it changed"
        in render("--frames", "2", *LIGHT).err
    )


def test_somebody_elses_picture_is_not_overwritten(render):
    os.mkdir("out")
    Image.new("RGB", (4, 4)).save("out/frame_0001.png")
    line = render("--frames", "2", *LIGHT, "-o", "out").failed_in_one_line()
    assert "'out/frame_0001.png' exists and is not a frame of this command" in line
    assert os.listdir("out") == ["frame_0001.png"]


def test_ctrl_c_keeps_finished_frames_and_the_next_run_goes_on(render, monkeypatch):
    asked = []

    def interrupt(self, done, total, text):
        if text.startswith("frame 3") and not asked:
            asked.append(text)
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr("mitsuba_diffraction.cli.console.Bar.__call__", interrupt)
    ran = render("--frames", "4", *LIGHT, "-s", "3", "-o", "out.webp")
    assert ran.code == 130
    assert "interrupted; 2 of 4 frames are done, run the command again to continue" in ran.err
    assert sorted(os.listdir("out")) == ["frame_0000.png", "frame_0001.png"]
    assert not os.path.exists("out.webp")
    again = render("--frames", "4", *LIGHT, "-s", "3", "-o", "out.webp")
    assert again.code == 0
    assert "4 frames, 2 of them new" in again.out


@pytest.mark.parametrize("suffix", [".webp", ".gif"])
def test_a_film_holds_all_frames_without_end(render, suffix):
    ran = render("--frames", "3", *LIGHT, "-o", f"film{suffix}", "--fps", "10")
    assert f"film{suffix}: 0.3 s at 10 frames a second" in ran.out
    with Image.open(f"film{suffix}") as film:
        assert film.n_frames == 3
        assert film.size == (16, 10)
        assert film.info["loop"] == 0
        film.seek(1)
        film.load()
        assert film.info["duration"] == 100


@pytest.mark.parametrize("fps", [24.0, 30.0, 60.0])
@pytest.mark.parametrize("suffix", [".webp", ".gif"])
def test_a_film_is_as_long_as_its_frames(tmp_path, suffix, fps):
    """GIF has frames of whole hundredths of a second."""
    files = [tmp_path / f"{n}.png" for n in range(30)]
    for n, file in enumerate(files):
        Image.new("RGB", (2, 2), (8 * n, 0, 0)).save(file)
    write_film(files, tmp_path / f"film{suffix}", fps)
    seconds = 0.0
    with Image.open(tmp_path / f"film{suffix}") as film:
        for n in range(film.n_frames):
            film.seek(n)
            film.load()
            seconds += 1e-3 * film.info["duration"]
    assert seconds == pytest.approx(len(files) / fps, abs=0.006)


def test_an_mp4_holds_all_frames(render):
    ffmpeg = pytest.importorskip("imageio_ffmpeg")
    assert render("--frames", "3", *LIGHT, "-o", "film.mp4", "--fps", "10").code == 0
    decoded = subprocess.run(
        [ffmpeg.get_ffmpeg_exe(), "-i", "film.mp4", "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True, check=True,
    )  # fmt: skip
    assert b"16x10" in decoded.stderr
    assert b"10 fps" in decoded.stderr
    frames = np.frombuffer(decoded.stdout, np.uint8).reshape(3, 10, 16, 3)
    pictures = []
    for n in range(3):
        with Image.open(f"film/frame_000{n}.png") as picture:
            pictures.append(np.asarray(picture))
    # eight bits of video, compressed
    np.testing.assert_allclose(frames.mean(axis=(1, 2)), np.mean(pictures, axis=(1, 2)), atol=3)


def test_a_film_without_its_extra_is_refused_before_the_work(render, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    line = render("--frames", "2", *LIGHT, "-o", "film.mp4").failed_in_one_line()
    assert "pip install 'imageio-ffmpeg>=" in line
    assert os.listdir() == ["room.xml"]


def test_linear_frames_can_be_asked_for(render):
    assert render("--frames", "2", *LIGHT, "--exr", "-o", "out").code == 0
    pixels = OpenEXR.File("out/frame_0001.exr").channels()["RGB"].pixels
    assert pixels[0, 0] == pytest.approx(0.4, rel=1e-5)


def test_a_preview_is_half_as_wide_and_quick(render):
    ran = render("--preview", "-D", "spp=512", "-o", "a.png")
    assert "a.png: 8 x 5 pixels, 16 samples per pixel" in ran.out
    assert "2 samples" in render("--preview", "-o", "a.png").out
    assert "3 samples" in render("--preview", "-s", "3", "-o", "a.png").out


@pytest.mark.parametrize(
    ("change", "said"),
    [("spp=2:3", "frame_0001: cannot load the scene: "), ("wide=16:-16", "frame_0002: ")],
    ids=["a fraction in a frame between", "a width of 0 in the last frame"],
)
def test_values_of_later_frames_are_refused_before_the_first_is_rendered(
    render, scene, change, said
):
    wide = SCENE.replace('"width" value="16"', '"width" value="$wide"')
    scene.write_text(wide.replace("<int", '<default name="wide" value="16"/><int', 1))
    line = render("--frames", "3", "--animate", change, "-o", "out").failed_in_one_line()
    assert said in line
    assert os.listdir() == ["room.xml"]


@pytest.mark.parametrize("option", ["--turn", "-D"])
def test_what_the_scene_does_not_use_is_said_and_leaves_no_folder(render, scene, option):
    scene.write_text(SCENE.replace('"word"/>', '"word"/><default name="idle" value="3"/>'))
    more = ("--turn", "idle") if option == "--turn" else ("-D", "idle=1", *LIGHT)
    line = render("--frames", "2", *more, "-o", "deep/out").failed_in_one_line()
    assert "no object of the scene uses $idle, although it declares it: write $idle where" in line
    assert os.listdir() == ["room.xml"]
