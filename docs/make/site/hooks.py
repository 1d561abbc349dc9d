"""Functions that MkDocs calls while it builds the site; see `hooks` in mkdocs.yml."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

from docs.make.site import formulas, links, reference

ROOT = Path(__file__).parents[3]


def on_files(files: Files, *, config: Any) -> Files:
    """Add README, the other pages at the root, the API reference and what pages link to."""
    for source, target in links.PAGES.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, target, content=links.rewritten(text, source)))
    files.append(File.generated(config, "api.md", content=reference.page()))
    for path in links.linked_files(ROOT):
        files.append(File.generated(config, path.as_posix(), abs_src_path=str(ROOT / path)))
    return files


def on_page_markdown(markdown: str, *, page: Page, config: Any, files: Files) -> str:
    """Let links that leave docs/ point to their places in the site."""
    source = page.file.src_uri
    if source in links.PAGES.values() or source == "api.md":
        return markdown
    return links.rewritten(markdown, f"docs/{source}")


def on_page_content(html: str, *, page: Page, config: Any, files: Files) -> str:
    """Typeset the formulas of a page."""
    return formulas.typeset(html)
