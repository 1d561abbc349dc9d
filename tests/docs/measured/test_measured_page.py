"""Page of the measured gratings."""

from __future__ import annotations

import re

import pytest

from docs.make.measured.__main__ import main

pytest.importorskip("gratinglab")
pytestmark = pytest.mark.thorough


def test_the_page_is_whole(tmp_path, capsys):
    assert main(["--quick", "-o", str(tmp_path)]) == 0
    text = (tmp_path / "validation" / "measured.md").read_text(encoding="utf-8")
    assert not re.search(r"\bnan\b", text)
    assert "{" not in text
    assert text.count("GMOS B1200") == 2
    assert (tmp_path / "images" / "measured_gratings.png").stat().st_size > 10_000
    assert "solved orders are within" in capsys.readouterr().out
