"""Time per picture while a page's camera or light is dragged, in a browser without a graphics card.

    python -m tests.support.dragging snake.html

A picture's time is from the start of its drawing until a pixel of it can be read from the screen's
own framebuffer; intervals are those between pictures; processor time is that of all the browser's
processes, which other programs do not lengthen.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from tests.support.browser import BROWSERS, FLAGS, Tab

_WATCH = """() => {
    window.pictures = [];
    const report = viewer.report;
    viewer.report = (sample, count) => {
        const { moving, time, width, height } = sample;
        if (moving) pictures.push([time, width, height, performance.now()]);
        report(sample, count);
    };
}"""


# moves within the page, one a frame: from outside each takes as long as the machine is busy
_MOVE = """async ([moves, shiftKey]) => {
    for (let n = 0; n < moves; ++n) {
        const clientX = 400 + 3 * n, clientY = 400 + 20 * Math.sin(0.2 * n);
        const move = { pointerId: 1, pointerType: "mouse", clientX, clientY, buttons: 1, shiftKey };
        viewer.canvas.dispatchEvent(new PointerEvent("pointermove", move));
        await new Promise(requestAnimationFrame);
    }
}"""


def main(argv: Sequence[str] | None = None) -> int:
    """Drag, and print what it took."""
    parser = argparse.ArgumentParser(prog="python -m tests.support.dragging")
    parser.add_argument("page", type=Path, help="written by export-viewer")
    parser.add_argument("--size", nargs=2, type=int, default=(1280, 800), metavar="PIXELS")
    parser.add_argument("--moves", type=int, default=80)
    args = parser.parse_args(argv)
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        path = next(p for p in map(shutil.which, BROWSERS) if p)
        browser = playwright.chromium.launch(executable_path=path, args=list(FLAGS))
        tab = Tab(browser, tuple(args.size))
        if tab.open(args.page.resolve()) != "ready":
            print(tab.page.inner_text("#message"), file=sys.stderr)
            return 1
        tab.page.evaluate(_WATCH)
        load = os.getloadavg()[0]
        print(f"{args.page.name}, {args.size[0]} × {args.size[1]}, load before: {load:.1f}")
        for name, key in (("camera", None), ("light", "Shift")):
            print(f"{name}: {_dragged(tab.page, args.size, args.moves, key)}")
        for line in tab.said:
            print(line, file=sys.stderr)
        browser.close()
    return 0


def _dragged(page: Any, size: Sequence[int], moves: int, key: str | None) -> str:
    """What a drag took, its first ten pictures left out, in which the page finds its size."""
    if key:
        page.keyboard.down(key)
    page.mouse.move(0.3 * size[0], 0.5 * size[1])
    page.mouse.down()
    page.evaluate(_MOVE, [10, key == "Shift"])
    page.evaluate("pictures.length = 0")
    before = _processor_time()
    page.evaluate(_MOVE, [moves, key == "Shift"])
    busy = _processor_time() - before
    page.mouse.up()
    if key:
        page.keyboard.up(key)
    found = np.array(page.evaluate("pictures"))
    median, most = np.percentile(found[:, 0], [50, 90])
    between, seldom = np.percentile(np.diff(found[:, 3]), [50, 90])
    return (
        f"{len(found)} pictures, median {median:.0f} ms, 90 % below {most:.0f} ms; intervals "
        f"{between:.0f} and {seldom:.0f} ms; processor time {1e3 * busy / len(found):.0f} ms each; "
        f"{np.median(found[:, 1]):.0f} × {np.median(found[:, 2]):.0f} pixels"
    )


def _processor_time() -> float:
    """Seconds of all processes that descend from this one, which are the browser's."""
    times = [child.cpu_times() for child in psutil.Process().children(recursive=True)]
    return sum(one.user + one.system for one in times)


if __name__ == "__main__":
    sys.exit(main())
