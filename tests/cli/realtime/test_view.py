"""`view`: the page of a scene, opened in a browser where there is one."""

from __future__ import annotations

import webbrowser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from mitsuba_diffraction.cli import main
from tests.support.plate import plate_file


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Addresses that are opened, in place of a browser with windows."""
    addresses: list[str] = []
    monkeypatch.setattr(webbrowser, "open", lambda address: not addresses.append(address))
    monkeypatch.setenv("BROWSER", "some")
    return addresses


def test_the_page_is_opened_with_its_start(
    tmp_path: Path, opened: list[str], some_variant: str
) -> None:
    out = tmp_path / "a plate.html"
    start = ["--method", "exact", "--exposure", "1.5"]
    assert main(["view", str(plate_file(tmp_path)), "-o", str(out), *start]) == 0
    assert out.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    (address,) = opened
    assert Path(unquote(urlsplit(address).path)) == out
    assert urlsplit(address).fragment == "method=exact&exposure=1.5"


def test_without_a_browser_the_address_is_said(
    tmp_path: Path, opened: list[str], monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str], some_variant: str,
) -> None:  # fmt: skip
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    assert main(["view", str(plate_file(tmp_path))]) == 0
    (page,) = tmp_path.glob("mitsuba-diffraction-*/plate.html")
    assert page.as_uri() in capsys.readouterr().out
    assert opened == []
