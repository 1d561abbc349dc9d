"""Blender as a separate process: the package and bpy need different versions of NumPy."""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Sequence
from pathlib import Path

from docs.make.figures.pages import Seconds
from mitsuba_diffraction.errors import DiffractionError

#: Variable that names a Python with bpy, or a `blender` executable.
VARIABLE = "MITSUBA_DIFFRACTION_BLENDER"
#: Interpreter of `make blender`.
DEFAULT = Path(__file__).parents[3] / ".venv/blender/bin/python"


def blender_command() -> list[str]:
    """Return the command that runs a script in Blender, without the script's name.

    Raises
    ------
    DiffractionError
        If there is no Blender.
    """
    named = os.environ.get(VARIABLE)
    program = Path(named) if named else DEFAULT
    if not program.exists():
        raise DiffractionError(
            f"no Blender at '{program}': run 'make blender', or name a Python with bpy, or a "
            f"blender executable, in {VARIABLE}"
        )
    if program.stem.lower().startswith("blender"):
        return [str(program), "--background", "--factory-startup", "--python-exit-code", "1",
                "--python"]  # fmt: skip
    return [str(program), "-W", "ignore"]


def run_in_blender(script: Path, words: Sequence[str | Path]) -> str:
    """Run a script in Blender without a window and return what it prints.

    Raises
    ------
    DiffractionError
        If it fails, with the last line of its output.
    """
    command = blender_command()
    between = ["--"] if "--python" in command else []
    finished = subprocess.run(
        [*command, script, *between, *words], capture_output=True, text=True, check=False
    )
    if finished.returncode != 0:
        said = (finished.stderr.strip() or finished.stdout.strip() or "no output").splitlines()
        raise DiffractionError(f"'{script.name}' failed in Blender ({command[0]}): {said[-1]}")
    return finished.stdout


def seconds(output: str) -> list[Seconds]:
    """Return the times of the renders that `inside.py` printed."""
    lines = re.findall(r"^seconds (\S+) processor (\S+)$", output, re.MULTILINE)
    return [Seconds(float(clock), float(processor)) for clock, processor in lines]
