"""Progress bars fit the terminal; Ctrl-C and SIGTERM end a command at once and leave nothing."""

from __future__ import annotations

import fcntl
import os
import pty
import signal
import struct
import subprocess
import sys
import termios
from pathlib import Path

import pytest

from mitsuba_diffraction.cli import interrupt
from mitsuba_diffraction.heights.source import Source
from tests.support import ROOT

pytestmark = pytest.mark.thorough

CODE = """
import argparse
from mitsuba_diffraction.cli import Bar
with Bar(argparse.Namespace(progress=None), delay=0) as bar:
    for n in range(20):
        bar(n, 20, "working")
"""

ENTRY = ROOT / "_mitsuba_diffraction.py"

#: Seconds: far from the ten minutes that the main thread would take.
SOON = 120

# In C++, as far as Python can tell: no signal handler runs on the main thread meanwhile.
STUCK = """
import ctypes
from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.heights import Source

def read(*_):
    with atomic_path("out.exr"):
        print("stuck", flush=True)
        ctypes.CDLL(None).sleep(600)

Source.of = read
"""


# The signals reach another thread, so that the sleep is not cut short.
HELD = "import mitsuba_diffraction.cli.interrupt as i; i.GRACE = 0.2\n" + STUCK.replace(
    'print("stuck", flush=True)',
    "signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT, signal.SIGTERM]); "
    'print("stuck", flush=True)',
)


@pytest.mark.parametrize("columns", [0, 40, 200])
def test_a_bar_is_redrawn_in_one_line(columns):
    ours, its = pty.openpty()
    fcntl.ioctl(its, termios.TIOCSWINSZ, struct.pack("HHHH", 24 if columns else 0, columns, 0, 0))
    subprocess.run([sys.executable, "-c", CODE], stderr=its, check=True)
    os.close(its)
    said = os.read(ours, 1 << 16).decode()
    drawn = said.split("\r")
    assert "working" in said
    assert "\n" not in said.strip()
    assert max(map(len, drawn)) <= (columns or 80)


def started(code: str, folder: Path, *words: str) -> subprocess.Popen[str]:
    lines = ["import signal, sys", "from mitsuba_diffraction.cli import main", code]
    lines += [f"sys.exit(main({words or ('info', 'x')}))"]
    return subprocess.Popen(
        [sys.executable, "-c", "\n".join(lines)], cwd=folder, text=True,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_ends_what_holds_the_main_thread(tmp_path, number, code):
    process = started(HELD, tmp_path)
    assert process.stdout is not None
    process.stdout.readline()
    assert len(os.listdir(tmp_path)) == 1  # the temporary file
    process.send_signal(number)
    _, said = process.communicate(timeout=SOON)
    assert process.returncode == code
    assert said.count("\n") == (1 if number == signal.SIGINT else 0), said
    assert os.listdir(tmp_path) == []


def test_a_second_ctrl_c_does_not_cut_the_last_line_short(run, monkeypatch):
    said = interrupt.say

    def say(text):
        signal.raise_signal(signal.SIGINT)
        said(text)

    monkeypatch.setattr(interrupt, "say", say)
    monkeypatch.setattr(Source, "of", lambda *_: signal.raise_signal(signal.SIGINT))
    ran = run("info", "x")
    assert ran.code == 130
    assert ran.err == "mitsuba-diffraction: interrupted; no half-written file was left behind\n"
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


# one of the first that the package imports, and of the last
@pytest.mark.parametrize(
    ("entry", "slow"),
    [
        ([str(ENTRY)], "numpy"),
        ([str(ENTRY)], "mitsuba"),
        (["-m", "mitsuba_diffraction"], "mitsuba"),
    ],
    ids=str,
)
def test_ctrl_c_while_the_package_is_imported_is_no_traceback(entry, slow, tmp_path):
    # stands for that module, whose import takes a while
    (tmp_path / f"{slow}.py").write_text("import time\nprint(flush=True)\ntime.sleep(600)\n")
    process = subprocess.Popen(
        [sys.executable, *entry, "render", "none.xml"], text=True, cwd=ROOT,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), str(ROOT)])},
        # as on a terminal, also if these tests run in a background that ignores it
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
    )  # fmt: skip
    assert process.stdout is not None
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=SOON)
    assert process.returncode == 130
    assert said == "mitsuba-diffraction: interrupted\n"


@pytest.mark.parametrize(
    ("raised", "code", "text"),
    [
        ("KeyboardInterrupt", 130, "interrupted; no half-written"),
        ("MemoryError", 1, "error: out of memory"),
        ("SystemExit(143)", 143, ""),
        ("ValueError", 1, "ValueError"),
    ],
)
def test_what_a_plugin_raises_while_a_scene_loads_is_not_swallowed(
    run, tmp_path, monkeypatch, some_variant, raised, code, text
):
    from mitsuba_diffraction.plugin import parameters

    def read(*_: object) -> None:
        raise eval(raised)

    monkeypatch.setattr(parameters, "nested_of", read)
    scene = tmp_path / "a.xml"
    scene.write_text(
        '<scene version="3.0.0"><shape type="sphere"><bsdf type="diffraction"/></shape></scene>'
    )
    ran = run("render", scene, "-m", some_variant, "-o", tmp_path / "a.exr")
    assert ran.code == code
    assert text in ran.err
    assert len(ran.err.splitlines()) == bool(text)
