"""Progress bars fit the terminal, whatever it says of itself."""

from __future__ import annotations

import fcntl
import os
import pty
import struct
import subprocess
import sys
import termios

import pytest

CODE = """
import argparse
from mitsuba_diffraction.cli import Bar
with Bar(argparse.Namespace(progress=None), delay=0) as bar:
    for n in range(20):
        bar(n, 20, "working")
"""


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
