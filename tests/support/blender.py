"""Blender as a separate program: a Python with bpy, or an executable of Blender itself."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pytest

from docs.make.blender.program import blender_command
from mitsuba_diffraction import DiffractionError

#: Seconds after which a program counts as stuck.
TIMEOUT = 300.0


def blender() -> list[str]:
    """Command that runs a script in Blender, without the script's name; skips without Blender."""
    try:
        return blender_command()
    except DiffractionError as error:
        pytest.skip(str(error))


def run_in_blender(
    script: Path, *arguments: str | os.PathLike[str]
) -> subprocess.CompletedProcess[str]:
    """Run a script in Blender; `sys.argv` of the script ends with the arguments, as text."""
    command = blender()
    between = ["--"] if "--python" in command else []
    return subprocess.run(
        [*command, str(script), *between, *map(str, arguments)],
        capture_output=True, text=True, errors="replace", timeout=TIMEOUT, check=False,
    )  # fmt: skip


def result_of(code: str, folder: Path, /, **values: Any) -> Any:
    """Run code in Blender, and return what it leaves in `result`, as JSON types.

    values : variables of the code, JSON types.
    """
    script, output = folder / "script.py", folder / "result.json"
    head = f"import json\nglobals().update(json.loads({json.dumps(values)!r}))\n"
    tail = f"\nopen({str(output)!r}, 'w').write(json.dumps(result))\n"
    script.write_text(head + code + tail, encoding="utf-8")
    output.unlink(missing_ok=True)
    done = run_in_blender(script)
    assert output.exists(), done.stdout + done.stderr
    return json.loads(output.read_text())
