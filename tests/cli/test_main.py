"""The boundary: whatever happens becomes one line and an exit code."""

from __future__ import annotations

import json
import os
import shlex
import signal
import subprocess
import sys
import warnings

import pytest

from mitsuba_diffraction import __version__
from mitsuba_diffraction.errors import DiffractionError, DiffractionWarning
from tests.support import ROOT
from tests.support.systems import posix


@pytest.fixture
def command(monkeypatch, heights):
    """Make `info` do something else, and return its arguments."""

    def replace(action):
        def run(args):
            action()
            return 0

        monkeypatch.setattr("mitsuba_diffraction.cli.info.run.run", run)
        return ["info", heights]

    return replace


def raising(error):
    def action():
        raise error

    return action


def test_the_parser_loads_no_command_s_machinery_and_the_package_runs_as_a_module():
    code = (
        "import sys\n"
        "from mitsuba_diffraction.cli.main import build_parser; build_parser()\n"
        "slow = {'tqdm', 'matplotlib', 'scipy.sparse', 'scipy.special', 'scipy.ndimage'}\n"
        "assert not slow & set(sys.modules)\n"
        "import runpy; sys.argv = ['mitsuba-diffraction', '--version']\n"
        "runpy.run_module('mitsuba_diffraction', run_name='__main__')"
    )
    words = [sys.executable, "-c", code]
    ran = subprocess.run(words, capture_output=True, text=True, timeout=120, check=True)
    assert ran.stdout == f"mitsuba-diffraction {__version__}\n"
    assert ran.stderr == ""


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("", ""), ("rendr", ""), ("info", ""), ("info a b", ""),
        ("--nonsense", ""), ("export-shader a --nonsense b", "unrecognized arguments: --nonsense"),
        ("info a --nonsense", "unrecognized arguments: --nonsense"),
    ],
)  # fmt: skip
def test_usage_errors_exit_with_2_and_are_one_line_that_names_the_help(run, line, said):
    ran = run(*line.split())
    assert ran.code == 2
    assert ran.err.startswith("mitsuba-diffraction")
    assert "error:" in ran.err
    name = f"{line.split()[0]} " if said else ""
    assert f"{name}--help" in ran.err
    assert said in ran.err
    assert ran.err.count("\n") == 1


def test_a_library_error_is_one_line(run, command):
    ran = run(*command(raising(DiffractionError("bad\n  input 'x'"))))
    assert ran.failed_in_one_line() == "mitsuba-diffraction: error: bad input 'x'"


def test_debug_before_or_after_the_command_shows_the_traceback(run, command):
    words = command(raising(DiffractionError("bad input")))
    for line in ([*words, "--debug"], ["--debug", *words]):
        ran = run(*line)
        assert ran.code == 1
        assert "Traceback" in ran.err
        assert ran.err.splitlines()[-1] == "mitsuba-diffraction: error: bad input"


def test_an_unforeseen_error_says_how_to_see_more(run, command):
    line = run(*command(raising(ZeroDivisionError("of\nall things")))).failed_in_one_line()
    assert "unexpected ZeroDivisionError: of all things" in line
    assert "--debug" in line


@pytest.mark.parametrize("error", [MemoryError(), OSError(28, "No space left on device", "f.npy")])
def test_the_machine_s_limits_are_one_line(run, command, error):
    line = run(*command(raising(error))).failed_in_one_line()
    assert "unexpected" not in line
    assert ("out of memory" in line) or ("No space left on device 'f.npy'" in line)


@pytest.mark.parametrize("name", ["x" * 5000, "a b " * 1500, f"/tmp/{'y' * 200}/z"])
@pytest.mark.parametrize("words", [["info"], ["render"], ["precompute"], ["render", "a.xml", "-s"]])
def test_long_names_are_not_echoed_whole(run, here, words, name):
    ran = run(*words, name)
    assert ran.code in (1, 2)
    assert len(ran.err.splitlines()[-1]) < 560


def test_ctrl_c_while_options_are_parsed_exits_with_130(run, monkeypatch):
    module = sys.modules["mitsuba_diffraction.cli.main"]  # the room has a function of this name
    monkeypatch.setattr(module, "build_parser", raising(KeyboardInterrupt()))
    ran = run("info", "x")
    assert ran.code == 130
    assert ran.err.startswith("mitsuba-diffraction: interrupted; ")
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("kind", [SystemError, ImportError])
def test_ctrl_c_within_the_import_of_an_extension_exits_with_130(run, command, kind):
    """Python and nanobind turn the interrupt into an error of another class."""

    def action():
        raise kind("Encountered an error while initializing") from KeyboardInterrupt()

    ran = run(*command(action))
    assert ran.code == 130
    assert "unexpected" not in ran.err
    assert f"unexpected {kind.__name__}" in run(*command(raising(kind("own")))).err


def test_a_warning_is_one_line_and_said_once(run, command):
    def action():
        for _ in range(2):
            warnings.warn("steep\n  slopes", DiffractionWarning, stacklevel=1)
        warnings.warn("coarse pixels", DiffractionWarning, stacklevel=1)

    ran = run(*command(action)).succeeded()
    assert ran.err.splitlines() == [
        "mitsuba-diffraction: warning: steep slopes",
        "mitsuba-diffraction: warning: coarse pixels",
    ]


def in_bash(line, folder, file, *options):
    """Run a line of bash in a folder, whose {} is `info` of a file with options."""
    words = [sys.executable, "-m", "mitsuba_diffraction", "info", str(file), *options]
    return subprocess.run(
        ["bash", "-c", line.format(shlex.join(words))],
        capture_output=True, text=True, timeout=120, cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


@posix
def test_a_closed_pipe_is_no_traceback(heights, here):
    ran = in_bash("{} | true", here, heights, "--pixel-size", "0.1", "--json")
    assert ran.stderr == ""


def test_a_termination_is_an_exit_code(run, heights, monkeypatch):
    terminate = "mitsuba_diffraction.cli.info._describe"
    monkeypatch.setattr(terminate, lambda *_: signal.raise_signal(signal.SIGTERM))
    assert run("info", heights, "--pixel-size", "0.1").code == 143


@pytest.mark.parametrize("stream", ["--json", "text"])
def test_names_do_not_control_the_terminal(run, here, heights, stream):
    hostile = here / "a\x1b]0;b\x07\u202ec.npy"
    hostile.write_bytes(heights.read_bytes())
    options = ["--json"] if stream == "--json" else []
    ran = run("info", hostile, "--pixel-size", "0.08", *options).succeeded()
    assert ran.out.isprintable() or not {"\x1b", "\x07", "\u202e"} & set(ran.out)
    if options:
        assert json.loads(ran.out)["file"] == str(hostile)
    line = run("info", here / "a\x1b\u202e.npy").failed_in_one_line()
    assert "\\x1b" in line
    assert not {"\x1b", "\u202e"} & set(line)


@posix
def test_a_deleted_working_folder_is_one_line(heights, tmp_path):
    gone = tmp_path / "gone"
    gone.mkdir()
    ran = in_bash(f"rmdir '{gone}' && {{}}", gone, heights)
    assert ran.returncode == 1
    (line,) = ran.stderr.splitlines()
    assert "current folder does not exist" in line


@posix
@pytest.mark.parametrize("closed", [">&-", ">&- 2>&- <&-"])
def test_closed_streams_are_no_error(heights, closed, tmp_path):
    ran = in_bash(f"{{}} {closed}", tmp_path, heights, "--pixel-size", "0.08", "--json", "a.json")
    assert ran.returncode == 0
    assert "Traceback" not in ran.stderr
    assert json.loads((tmp_path / "a.json").read_text("utf-8"))["kind"] == "height field"


def test_a_failing_import_is_one_line(tmp_path):
    (tmp_path / "mitsuba.py").write_text("raise ImportError('failed to map segment')")
    ran = subprocess.run(
        [sys.executable, "-m", "mitsuba_diffraction", "info", "a.npy"],
        capture_output=True, text=True, timeout=120, cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])},
    )  # fmt: skip
    assert ran.returncode == 1
    (line,) = ran.stderr.splitlines()
    assert "failed to map segment" in line
