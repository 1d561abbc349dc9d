"""A small scene for a page, and the browser's tab that shows it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import mitsuba_diffraction as md
from tests.support.variants import VARIANTS, use

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--enable-unsafe-swiftshader",
)  # fmt: skip
SIZE = (96, 64)
#: Milliseconds that a page may take for anything: shaders are compiled in software, on a machine
#: that may be busy.
PATIENCE = 600_000
#: As soon as there is a viewer, it draws no more than a test asks for, and a test can wait for it.
#: In a frame of a page scripts like this one may come after the page's own.
ONE_SAMPLE = f"""{{
    const prepare = (viewer) => {{
        viewer.most = 1;
        // wait until a still picture has so many samples
        viewer.settled = (count = viewer.enough) => {{
            const end = Date.now() + {PATIENCE};
            viewer.wake();
            return new Promise((resolve, reject) => {{
                const look = () => {{
                    const {{ moving, dirty, latest }} = viewer;
                    if (!moving && !dirty && latest?.moving === false && viewer.count >= count)
                        resolve();
                    else if (Date.now() > end) reject(new Error(`there are no ${{count}} samples`));
                    else setTimeout(look, 5);
                }};
                look();
            }});
        }};
    }};
    if (window.viewer) prepare(window.viewer);
    else Object.defineProperty(window, "viewer", {{ configurable: true, set(viewer) {{
        prepare(viewer);
        Object.defineProperty(window, "viewer", {{ value: viewer }});
    }} }});
}}
"""


def load_scene(**surface: Any) -> Any:
    """A grating on a roll over diffuse grey, on chequered ground, under a sun and a lamp.

    surface : parameters of the roll's BSDF in place of these; None leaves one out.
    """
    import mitsuba as mi
    import numpy as np

    use(*VARIANTS)
    transform = mi.ScalarTransform4f
    chequers = np.full((8, 8, 3), 0.1, np.float32)
    chequers[::2, ::2] = [0.5, 0.3, 0.2]
    grating = md.gratings.sinusoidal(period=1.6, depth=0.06, periods=4)
    grey = {"type": "diffuse", "reflectance": 0.1}
    parameters = {
        "coherence_width": 6, "orientation": 30.0, "int_ior": 1.5,
        "pigment": grey,
    } | surface  # fmt: skip
    film = {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1]}
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective", "fov": 30, "film": film,
                "to_world": transform().look_at([0, -6, 4], [0, 0, 0.7], [0, 0, 1]),
            },
            "roll": {
                "type": "cylinder", "p0": [-1.2, 0.3, 0.9], "p1": [1.2, -0.3, 0.9], "radius": 0.9,
                "bsdf": md.bsdf_dict(
                    grating, **{k: v for k, v in parameters.items() if v is not None}
                ),
            },
            "ground": {
                "type": "rectangle", "to_world": transform().scale(5),
                "bsdf": {
                    "type": "diffuse",
                    "reflectance": {"type": "bitmap", "bitmap": mi.Bitmap(chequers), "raw": False},
                },
            },
            "sun": {"type": "directional", "direction": [0.3, 1, -1.2], "irradiance": 3.0},
            "lamp": {"type": "point", "position": [2, -3, 4], "intensity": 10.0},
        }
    )  # fmt: skip


class Tab:
    """A page that is open, with all that it says and asks for."""

    def __init__(
        self, browser: Any, size: tuple[int, int], script: str = "", phone: bool = False
    ) -> None:
        # fewer pixels than a phone's: shaders run in software
        kind = {"has_touch": True, "is_mobile": True, "device_scale_factor": 0.5} if phone else {}
        self.page = browser.new_page(viewport={"width": size[0], "height": size[1]}, **kind)
        self.page.set_default_timeout(PATIENCE)
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self._heard(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.add_init_script(ONE_SAMPLE + script)

    def _heard(self, text: str) -> None:
        # frames are timed on purpose, which drivers in software remark upon
        if "GPU stall due to ReadPixels" not in text:
            self.said.append(text)

    def open(self, path: Path) -> str:
        """Load a file and return the state that it reaches: ready, or failed."""
        self.page.goto(path.as_uri())
        return self.state(self.page)

    @staticmethod
    def state(frame: Any) -> str:
        """Wait until a page has loaded or given up."""
        frame.wait_for_function("document.documentElement.dataset.state", timeout=PATIENCE)
        return str(frame.evaluate("document.documentElement.dataset.state"))
