"""Operating systems: the package does without what only POSIX has, and prints UTF-8 everywhere."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support import ROOT

pytestmark = pytest.mark.thorough

# Python as on Windows: modules and functions of POSIX alone are absent. Other packages keep them.
WITHOUT_POSIX = """
import os, pkgutil, signal, sys
import filelock, psutil, tqdm  # other packages
for name in ("fcntl", "resource", "termios", "pty", "pwd", "grp"):
    sys.modules[name] = None
for name in ("fork", "setsid", "killpg", "sched_getaffinity", "getloadavg", "sysconf", "mkfifo"):
    vars(os).pop(name, None)
for name in ("SIGALRM", "SIGKILL", "SIGHUP", "SIGUSR1", "alarm", "pthread_sigmask"):
    vars(signal).pop(name, None)
"""

COMMANDS = """
import importlib
import mitsuba_diffraction as md
import mitsuba as mi
from _mitsuba_diffraction import main
mi.set_variant("scalar_spectral")
for module in pkgutil.walk_packages(md.__path__, "mitsuba_diffraction."):
    if module.name != "mitsuba_diffraction.__main__":
        importlib.import_module(module.name)
grating = md.gratings.sinusoidal(1.6, 0.06, periods=2)
mi.load_dict(md.bsdf_dict(grating, coherence_width=2, energy_conserving=False))
sys.argv[1:] = ["precompute", "grating.toml", "-o", "grating.exr"]
sys.exit(main())
"""

RECIPE = """
generator = "sinusoidal"
coherence_width = 2.0

[arguments]
period = 1.6
depth = 0.06
periods = 2
"""


def run(folder: Path, code: str, **variables: str) -> subprocess.CompletedProcess[str]:
    """Run a program of its own in a folder."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MITSUBA_DIFFRACTION_CACHE": str(folder)}
    return subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        cwd=folder, env={**environment, **variables}, capture_output=True, encoding="utf-8",
    )  # fmt: skip


def test_package_and_commands_need_nothing_of_posix_alone(tmp_path):
    """Output is UTF-8, too, in the C locale of a terminal that says nothing of it."""
    (tmp_path / "grating.toml").write_text(RECIPE)
    # Python would choose UTF-8 by itself in the C locale
    ascii_only = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}
    ran = run(tmp_path, WITHOUT_POSIX + COMMANDS, **ascii_only)
    assert ran.returncode == 0, ran.stderr
    assert "µm" in ran.stdout
    assert (tmp_path / "grating.exr").is_file()
    assert [file.suffix for file in tmp_path.glob("table-*")] == [".cache"]


# how Dr.Jit 1.5 fails without libatomic
WITHOUT_ATOMIC = """
try:
    raise ImportError("libatomic.so.1: cannot open shared object file")
except ImportError:
    _drjit_ext
"""


def test_missing_library_of_the_system_is_one_line(tmp_path):
    (tmp_path / "drjit.py").write_text(WITHOUT_ATOMIC)
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    ran = run(tmp_path, "import _mitsuba_diffraction as m; m.main()", PYTHONPATH=path)
    assert ran.returncode == 1
    (line,) = ran.stderr.splitlines()
    assert "libatomic.so.1: cannot open" in line
    assert "apt install libatomic1" in line
