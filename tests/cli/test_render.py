"""`render`: a scene in, pictures out, or one line and nothing half-written."""

from __future__ import annotations

import os
import signal

import mitsuba as mi
import numpy as np
import OpenEXR
import pytest
from PIL import Image

from mitsuba_diffraction.cli.main import build_parser
from mitsuba_diffraction.cli.passes import Stop, render_passes, samples_per_pass

# A sphere that fills half of a white room: every pixel in (0, 1].
SCENE = """<scene version="3.5.0">
  <default name="spp" value="4"/>
  <default name="format" value="rgb"/>
  <integrator type="path"/>
  <sensor type="perspective">
    <transform name="to_world"><lookat origin="0,0,4" target="0,0,0" up="0,1,0"/></transform>
    <film type="hdrfilm">
      <integer name="width" value="24"/><integer name="height" value="16"/>
      <string name="pixel_format" value="$format"/>
    </film>
    <sampler type="independent"><integer name="sample_count" value="$spp"/></sampler>
  </sensor>
  <emitter type="constant"><rgb name="radiance" value="0.5"/></emitter>
  <shape type="sphere"><bsdf type="diffuse"/></shape>
</scene>
"""
QUICK = ["-m", "scalar_rgb"]


@pytest.fixture
def scene(tmp_path, monkeypatch):
    """A scene in a folder that is the current one."""
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "room.xml"
    file.write_text(SCENE)
    return file


def pixels(path):
    """Colours of an EXR."""
    channels = OpenEXR.File(str(path)).channels()
    (name,) = [n for n in channels if n in ("RGB", "RGBA", "Y")]
    return channels[name].pixels


def png(path):
    """Values of a PNG, and what they mean."""
    with Image.open(path) as image:
        return np.asarray(image), image.mode


def test_an_exr_and_a_png_are_written_and_named(run, scene):
    ran = run("render", scene, *QUICK)
    assert ran.code == 0
    assert sorted(os.listdir()) == ["room.exr", "room.png", "room.xml"]
    assert ran.out.startswith("room.exr and room.png: 24 x 16 pixels, 4 samples per pixel, ")
    assert pixels("room.exr").shape == (16, 24, 3)
    assert pixels("room.exr").dtype == np.float32
    assert OpenEXR.File("room.exr").header()["spp"] == 4


def test_a_png_alone_can_be_asked_for(run, scene):
    assert run("render", scene, *QUICK, "-o", "a.png").code == 0
    assert sorted(os.listdir()) == ["a.png", "room.xml"]


def test_the_png_is_srgb_and_exposure_is_in_stops(run, scene):
    assert run("render", scene, *QUICK, "-s", "1", "-o", "a.exr", "--exposure", "0.5").code == 0
    linear = np.minimum(pixels("a.exr") * 2**0.5, 1)
    # IEC 61966-2-1
    encoded = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    shown, _ = png("a.png")
    assert np.abs(shown - 255 * encoded).max() < 1  # Mitsuba dithers between the two neighbours


def test_the_corner_shows_the_emitter(run, scene):
    assert run("render", scene, *QUICK, "-o", "a.exr").code == 0
    assert pixels("a.exr")[0, 0] == pytest.approx(0.5, rel=1e-3)


def test_seeds_repeat_and_differ(run, scene):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert run("render", scene, *QUICK, "-o", f"{name}.exr", "--seed", seed).code == 0
    # to single precision: the threads' blocks are added up in any order
    assert pixels("a.exr") == pytest.approx(pixels("b.exr"), rel=1e-5)
    assert pixels("a.exr") != pytest.approx(pixels("c.exr"), rel=1e-3)


def test_parameters_reach_the_scene(run, scene):
    ran = run("render", scene, *QUICK, "-D", "spp=2", "-D", "format=luminance", "-o", "a.exr")
    assert "2 samples per pixel" in ran.out
    assert list(OpenEXR.File("a.exr").channels()) == ["Y"]


@pytest.mark.parametrize(
    ("pixel_format", "mode"),
    [("rgba", "RGBA"), ("xyz", "RGB"), ("luminance", "L"), ("luminance_alpha", "LA")],
)
def test_films_of_every_format_give_a_png(run, scene, pixel_format, mode):
    assert run("render", scene, *QUICK, "-D", f"format={pixel_format}", "-o", "a.png").code == 0
    assert png("a.png")[1] == mode


def test_alpha_is_straight_in_the_png(run, scene):
    scene.write_text(SCENE.replace('<integrator type="path"/>', '<integrator type="path"><boolean '
                                   'name="hide_emitters" value="true"/></integrator>'))  # fmt: skip
    assert run("render", scene, *QUICK, "-D", "format=rgba", "-o", "a.exr", "-s", "16").code == 0
    linear, (shown, _) = pixels("a.exr"), png("a.png")
    assert shown[0, 0, 3] == 0
    edge = (linear[..., 3] > 0.3) & (linear[..., 3] < 0.9)
    assert edge.any()
    # the sphere is as bright at its half covered edge as inside: 0.5 · 0.5 in an sRGB byte
    assert np.abs(shown[edge][:, :3].astype(float) - 137).max() < 25


def passes(scene, *, spp, size, stop=None, progress=lambda *_: None):
    """render_passes with passes of `size`, as seed 5 gives them."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitsuba_diffraction.cli.passes.samples_per_pass", lambda *_: size)
        return render_passes(
            scene, scene.sensors()[0], spp=spp, seed=5, variant=mi.variant(),
            stop=stop or Stop(), progress=progress,
        )  # fmt: skip


LAMP = '<emitter type="point"><point name="position" x="2" y="2" z="3"/></emitter>'


@pytest.mark.parametrize("integrator", ["path", "ptracer"])
@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
def test_passes_average_to_the_mean_weighted_by_samples(scene, variant, integrator):
    # a box filter gives every sample to one pixel: there the average of pictures is exact, too
    scene.write_text(
        SCENE.replace("</film>", '<rfilter type="box"/></film>')
        .replace('"path"', f'"{integrator}"')
        .replace("  <shape", LAMP + "  <shape")
    )
    mi.set_variant(variant)
    loaded = mi.load_file(str(scene))
    result = passes(loaded, spp=7, size=3)
    assert result.spp == 7
    expected = 0.0
    for sequence, spp in zip(np.random.SeedSequence(5).spawn(3), (3, 3, 1), strict=True):
        seed = int(sequence.generate_state(1)[0])
        expected = expected + spp / 7 * np.array(mi.render(loaded, spp=spp, seed=seed))
    assert np.array(result.bitmap) == pytest.approx(expected, rel=1e-5, abs=1e-6)  # single


def test_a_pass_of_one_size_divides_the_samples():
    pixels = 512 * 512
    assert samples_per_pass(256, pixels, "llvm_ad_rgb") == 8
    assert samples_per_pass(100, pixels, "llvm_ad_rgb") == 5
    assert samples_per_pass(97, pixels, "llvm_ad_rgb") == 8
    assert samples_per_pass(4, pixels, "llvm_ad_rgb") == 4
    assert samples_per_pass(256, 10**9, "cuda_ad_rgb") == 1
    assert samples_per_pass(256, pixels, "scalar_rgb") == 1


def test_asked_to_stop_it_keeps_the_passes_so_far(scene):
    mi.set_variant("llvm_ad_rgb")
    stop = Stop()

    def progress(done, total, text):
        stop.asked = done >= 4

    result = passes(mi.load_file(str(scene)), spp=100, size=2, stop=stop, progress=progress)
    assert result.interrupted
    assert result.spp == 4
    assert np.array(result.bitmap)[0, 0] == pytest.approx(0.5, rel=1e-3)


def test_ctrl_c_keeps_the_picture_so_far(run, scene, monkeypatch):
    def interrupt(self, done, total, text):
        if done == 2:
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("mitsuba_diffraction.cli.progress.Bar.__call__", interrupt)
    ran = run("render", scene, *QUICK, "-s", "50", "-o", "a.exr")
    assert ran.code == 130
    assert ran.err.splitlines() == [
        "mitsuba-diffraction: interrupted; the picture has 2 of 50 samples per pixel"
    ]
    assert pixels("a.exr")[0, 0] == pytest.approx(0.5, rel=1e-3)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_ctrl_c_before_the_first_pass_writes_nothing(run, scene, monkeypatch):
    monkeypatch.setattr(
        "mitsuba_diffraction.cli.progress.Bar.__call__",
        lambda *_: os.kill(os.getpid(), signal.SIGINT),
    )
    assert run("render", scene, *QUICK, "-o", "a.exr").code == 130
    assert os.listdir() == ["room.xml"]


def test_the_default_variant_is_spectral(child, scene):
    ran = child(["render", scene, "-s", "1"])
    assert ran.code == 0, ran.err
    assert "_ad_spectral" in ran.out


def test_films_without_colours_are_written_as_exr_only(run, scene):
    scene.write_text(
        SCENE.replace('type="hdrfilm"', 'type="specfilm"')
        .replace('<string name="pixel_format" value="$format"/>', '<spectrum name="band_a" '
                 'value="400:0, 500:1, 600:0"/>')
    )  # fmt: skip
    mode = ["-m", "scalar_spectral", "-s", "1"]
    ran = run("render", scene, *mode, "-o", "a.exr")
    assert ran.code == 0
    assert "only the EXR was written" in ran.err
    assert list(OpenEXR.File("a.exr").channels()) == ["band_a"]
    line = run("render", scene, *mode, "-o", "b.png").failed_in_one_line()
    assert "name an EXR: -o b.exr" in line
    assert sorted(os.listdir()) == ["a.exr", "room.xml"]


def test_further_channels_are_kept_in_the_exr(run, scene):
    scene.write_text(
        SCENE.replace(
            '<integrator type="path"/>',
            '<integrator type="aov"><string name="aovs" value="dd:depth"/>'
            '<integrator type="path"/></integrator>',
        )
    )
    assert run("render", scene, *QUICK, "-o", "a.exr").code == 0
    assert {"RGB", "dd.T"} <= set(OpenEXR.File("a.exr").channels())
    assert png("a.png")[1] == "RGB"


def test_pixels_that_are_not_numbers_are_counted(run, scene):
    scene.write_text(SCENE.replace('<rgb name="radiance" value="0.5"/>',
                                   '<spectrum name="radiance" value="nan"/>'))  # fmt: skip
    ran = run("render", scene, *QUICK, "-o", "a.exr", "-s", "1")
    assert ran.code == 0
    assert "pixels are not finite" in ran.err


def test_a_sensor_is_chosen_by_its_number(run, scene):
    second = SCENE[SCENE.index("  <sensor") : SCENE.index("  <emitter")].replace('"24"', '"8"')
    scene.write_text(SCENE.replace("  <emitter", second + "  <emitter"))
    assert "8 x 16" in run("render", scene, *QUICK, "--sensor", "1", "-o", "a.png").out
    line = run("render", scene, *QUICK, "--sensor", "2").failed_in_one_line()
    assert "--sensor 2: the scene has 2" in line


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("$spp", "$samples", "undefined parameter: $samples"),
        ('"diffuse"', '"velvet"', "there is no bsdf plugin 'velvet'"),
        ('"sphere"', '"ply"', "shape 'ply'"),
        ("</scene>", "", "line"),
        ("$spp", "some", "could not parse"),
        ("<scene", "<bsdf", "room.xml"),
        ('<integrator type="path"/>', '<integrator type="path"><float name="depth" value="1"/>'
         "</integrator>", "no such parameter"),
    ],
)  # fmt: skip
def test_scenes_that_do_not_load_are_one_line(run, scene, old, new, said):
    scene.write_text(SCENE.replace(old, new))
    assert said in run("render", scene, *QUICK).failed_in_one_line()
    assert os.listdir() == ["room.xml"]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["-D", "ssp=3"], "did you mean spp?"),
        (["-D", "parallel=3"], "no parameter 'parallel'"),
        (["-D", "spp=many"], "could not parse"),
        (["-m", "cuda_rgb"], "there is no variant 'cuda_rgb'; there are scalar_rgb"),
        (["-o", "nowhere/a.exr"], "cannot write 'nowhere/a.exr'"),
        (["-o", "/proc/a.png"], "cannot write '/proc/a.png'"),
    ],
)
def test_arguments_that_do_not_fit_are_one_line(run, scene, arguments, said):
    assert said in run("render", scene, *QUICK, *arguments).failed_in_one_line()
    assert os.listdir() == ["room.xml"]


@pytest.mark.parametrize("content", [None, "", "no scene", '<scene version="3.5.0">'])
def test_files_that_are_no_scene_are_one_line(run, scene, content):
    if content is None:
        scene.unlink()
    else:
        scene.write_text(content)
    assert "room.xml" in run("render", scene, *QUICK).failed_in_one_line()


def test_a_folder_is_no_scene(run, scene):
    assert "is a folder" in run("render", scene.parent, *QUICK).failed_in_one_line()


@pytest.mark.parametrize(
    "arguments",
    [
        ["-D", "spp"],
        ["-D", "=3"],
        ["-D", "spp=1", "-D", "spp=2"],
        ["-s", "0"],
        ["-s", "few"],
        ["--seed", "-1"],
        ["--exposure", "nan"],
        ["-o", "a.jpg"],
        ["-o", "folder"],
    ],
)
def test_unusable_options_are_usage_errors(run, scene, arguments):
    ran = run("render", scene, *QUICK, *arguments)
    assert ran.code == 2
    assert ran.err.startswith("usage: ")


def test_the_output_is_checked_before_the_scene_is_loaded(run, scene, monkeypatch):
    monkeypatch.setattr(mi, "load_file", lambda *_, **__: pytest.fail("loaded"))
    (scene.parent / "a.png").mkdir()
    assert (
        "'a.png': it is a folder"
        in run("render", scene, *QUICK, "-o", "a.exr").failed_in_one_line()
    )


@pytest.mark.parametrize("output", ["a.exr", "a.png"])
def test_a_full_disk_is_one_line_and_leaves_nothing(child, scene, output):
    scene.write_text(SCENE.replace('"24"', '"200"'))
    ran = child(["render", scene, *QUICK, "-s", "1", "-o", output], limit=1000)
    assert f"cannot write '{output}': File too large" in ran.failed_in_one_line()
    assert os.listdir() == ["room.xml"]


def test_definitions_may_hold_equal_signs():
    args = build_parser().parse_args(["render", "a", "-D", "a=b=c", "-D", "d="])
    assert args.parameters == [("a", "b=c"), ("d", "")]


@pytest.fixture
def patch_scene(scene, heights, monkeypatch):
    """The room with the grating on its sphere; tables are cached in the same folder only."""
    monkeypatch.setenv("MITSUBA_DIFFRACTION_CACHE", str(scene.parent / "cache"))
    scene.write_text(
        SCENE.replace(
            '<bsdf type="diffuse"/>',
            '<bsdf type="diffraction"><string name="heightfield" value="$patch"/>'
            '<float name="pixel_size" value="$pixel_size"/>'
            '<float name="coherence_width" value="6"/></bsdf>',
        ).replace(
            "  <integrator",
            f'<default name="patch" value="{heights}"/><default name="pixel_size" value="0.08"/>'
            "  <integrator",
            1,
        )
    )
    return scene


def test_a_diffracting_scene_renders(run, patch_scene):
    ran = run("render", patch_scene, "-m", "llvm_ad_spectral", "-s", "1", "-o", "a.exr")
    assert ran.code == 0, ran.err
    picture = pixels("a.exr")
    assert np.isfinite(picture).all()
    assert picture[8, 12].sum() > 0  # the sphere reflects the room


@pytest.mark.parametrize(
    ("definition", "said"),
    [
        ("patch=nofile.npy", "'nofile.npy' does not exist"),
        ("pixel_size=0", "pixel_size"),
        ("pixel_size=-1", "pixel_size"),
    ],
)
def test_a_patch_that_does_not_fit_is_one_line(run, patch_scene, definition, said):
    line = run("render", patch_scene, "-m", "llvm_ad_spectral", "-D", definition)
    assert said in line.failed_in_one_line()
    assert "room.xml', line" in line.err


def test_doubts_about_a_patch_are_said_once(run, patch_scene):
    ran = run(
        "render", patch_scene, "-m", "llvm_ad_spectral", "-s", "1", "-o", "a.png",
        "-D", "pixel_size=0.2",
    )  # fmt: skip
    assert ran.code == 0
    assert sum("coarser than a quarter" in line for line in ran.err.splitlines()) == 1


def test_ctrl_c_while_compiling_writes_nothing(run, scene, monkeypatch):
    def interrupt(self, done, total, text):
        if text == "compiling":
            os.kill(os.getpid(), signal.SIGINT)

    monkeypatch.setattr("mitsuba_diffraction.cli.progress.Bar.__call__", interrupt)
    ran = run("render", scene, *QUICK, "-o", "a.exr")
    assert ran.code == 130
    assert "nothing half-written" in ran.err
    assert os.listdir() == ["room.xml"]
