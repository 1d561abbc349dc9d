"""Text of README, docs and notebooks: code blocks, spans and commands."""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator

from tests.support import ROOT

PAGES = {
    path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8")
    for path in (
        *(ROOT / name for name in ("README.md", "ARCHITECTURE.md", "CHANGELOG.md")),
        *(ROOT / name for name in ("CONTRIBUTING.md", "SECURITY.md")),
        *sorted((ROOT / "docs").rglob("*.md")),
    )
}
# what the notebooks say between their cells; test_notebooks.py runs these
PAGES |= {
    path.relative_to(ROOT).as_posix(): "\n\n".join(
        "".join(cell["source"])
        for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]
        if cell["cell_type"] == "markdown"
    )
    for path in sorted((ROOT / "notebooks").glob("*.ipynb"))
}
FENCE = re.compile(r"^ *```(\w*)\n(.*?)^ *```$", re.M | re.S)


def blocks(page: str, language: str) -> list[str]:
    """Code blocks of a page, in that language."""
    return [text for name, text in FENCE.findall(PAGES[page]) if name == language]


def markers(text: str) -> list[str]:
    """Names of the generated parts of a page."""
    return re.findall(r"<!-- begin (\S+) -->", text)


def files_of(page: str) -> dict[str, str]:
    """The TOML files of a page by name: their blocks begin with `# NAME`."""
    named = (re.match(r"# (\S+\.toml)\n", text) for text in blocks(page, "toml"))
    return {found[1]: found.string for found in named if found}


def spans(page: str) -> list[str]:
    """Code within a page's sentences, on one line each."""
    return [" ".join(s.split()) for s in re.findall(r"`([^`]+)`", FENCE.sub("", PAGES[page]))]


def typed(text: str) -> list[list[str]]:
    """The words of each command of a shell block."""
    lines = text.replace("\\\n", " ").splitlines()
    return [words for line in lines if (words := shlex.split(line, comments=True))]


def first_columns(page: str) -> Iterator[set[str]]:
    """Yield the names in code spans of the first column of each table."""
    for table in re.findall(r"(?:^\|.*\n)+", PAGES[page], re.M):
        cells = (row.split("|")[1] for row in table.splitlines()[2:])
        yield {name for cell in cells for name in re.findall(r"`(\w+)`", cell)}
