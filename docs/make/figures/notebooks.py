"""Run the notebooks, and store their outputs in their files.

    python -m docs.make.figures.notebooks [notebooks/first_render.ipynb ...]

They run with this copy of the package, in their own folder, as Jupyter would run them.
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path
from typing import Any

from mitsuba_diffraction.atomic import atomic_path
from mitsuba_diffraction.errors import DiffractionError

from .pages import option, program

ROOT = Path(__file__).resolve().parents[3]

# Cells take seconds; a machine that does ten things at once may take ten times as long.
_TIMEOUT = 300


def execute(path: Path) -> Any:
    """Return the notebook with new outputs; its file is not changed."""
    try:
        import nbclient
        import nbformat
    except ImportError as error:
        raise DiffractionError(
            f"notebooks are run with {error.name}: pip install 'mitsuba_diffraction[notebooks]'"
        ) from error
    try:
        notebook = nbformat.read(path, as_version=4)
    except (OSError, nbformat.reader.NotJSONError) as error:
        raise DiffractionError(f"'{path}' is not a notebook that can be read: {error}") from error
    client = nbclient.NotebookClient(
        notebook, timeout=_TIMEOUT, resources={"metadata": {"path": str(path.parent)}}
    )
    try:
        client.execute(env=_environment())
    except nbclient.exceptions.CellExecutionError as error:
        ran = [cell for cell in notebook.cells if cell.cell_type == "code" and cell.execution_count]
        reason = f"{error.ename}: {error.evalue}".strip().splitlines()[0]
        raise DiffractionError(f"'{path}': cell [{len(ran)}] fails: {reason}") from error
    except (nbclient.exceptions.CellTimeoutError, nbclient.exceptions.DeadKernelError) as error:
        raise DiffractionError(f"'{path}': {str(error).splitlines()[0]}") from error
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)  # when it ran, which is another time every time
    return notebook


def _environment() -> dict[str, str]:
    """Environment of the kernel: this copy of the package first, and figures in the cells."""
    environment = {name: value for name, value in os.environ.items() if name != "MPLBACKEND"}
    before = environment.get("PYTHONPATH")
    environment["PYTHONPATH"] = os.pathsep.join([str(ROOT), *([before] if before else [])])
    return environment


@program(
    option("notebooks", metavar="FILE", type=Path, nargs="*", help="default: all of notebooks"),
)
def main(args: argparse.Namespace) -> None:
    """Run notebooks, all of the project by default, and write each one that succeeds."""
    paths = args.notebooks or sorted((ROOT / "notebooks").glob("*.ipynb"))
    if not paths:
        raise DiffractionError(f"no notebooks in '{ROOT / 'notebooks'}'; name one")
    for path in paths:
        print(f"{path}: running", flush=True)
        start = time.perf_counter()
        notebook = execute(path)
        import nbformat  # after `execute` has said what to do without it

        with atomic_path(path) as temporary:
            nbformat.write(notebook, temporary)
        seconds = time.perf_counter() - start
        print(f"{path}: {seconds:.1f} s, {path.stat().st_size / 1e3:.0f} kB", flush=True)
