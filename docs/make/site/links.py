"""Links between pages of the site, and files of the repository that pages link to.

docs/ is the root of the site. All other files keep their paths: notebooks/, scenes/, LICENSE.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

#: Pages at the root of the repository, and their names in the site.
PAGES = {
    "README.md": "index.md",
    "ARCHITECTURE.md": "architecture.md",
    "CONTRIBUTING.md": "contributing.md",
    "SECURITY.md": "security.md",
    "CHANGELOG.md": "changelog.md",
}

_LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^)\s]+)\)")
_FENCE = re.compile(r"(^ *```.*?^ *```$)", re.M | re.S)


def rewritten(text: str, source: str) -> str:
    """Return a page's text with links as the site has them.

    Parameters
    ----------
    source : path of the page in the repository. Links to folders become plain text.
    """
    in_site = _in_site(source)

    def replace(match: re.Match[str]) -> str:
        mark, label, target = match.groups()
        if "://" in target or target.startswith("#"):
            return match[0]
        path, _, anchor = target.partition("#")
        place = posixpath.normpath(posixpath.join(posixpath.dirname(source), path))
        if not PurePosixPath(place).suffix and place not in ("LICENSE", "Makefile"):
            return label
        relative = posixpath.relpath(_in_site(place), posixpath.dirname(in_site) or ".")
        return f"{mark}[{label}]({relative}{'#' if anchor else ''}{anchor})"

    parts = _FENCE.split(text)
    return "".join(part if n % 2 else _LINK.sub(replace, part) for n, part in enumerate(parts))


def linked_files(root: Path) -> Iterator[Path]:
    """Yield files outside of docs/ that pages link to, relative to the repository."""
    seen = set()
    for page in [*map(Path, PAGES), *(p.relative_to(root) for p in (root / "docs").rglob("*.md"))]:
        text = _FENCE.sub("", (root / page).read_text(encoding="utf-8"))
        for _, _, target in _LINK.findall(text):
            if "://" in target:
                continue
            path = Path(posixpath.normpath((page.parent / target.partition("#")[0]).as_posix()))
            outside = path.parts[:1] != ("docs",) and path.as_posix() not in PAGES
            if outside and path not in seen and (root / path).is_file():
                seen.add(path)
                yield path


def _in_site(place: str) -> str:
    """Return the path in the site of a file of the repository."""
    if place in PAGES:
        return PAGES[place]
    return place.removeprefix("docs/")
