"""A window with a panel of ImGui in it (extra `view`)."""

from __future__ import annotations

from typing import Any

import moderngl_window
from imgui_bundle import imgui
from moderngl_window.integrations.imgui_bundle import ModernglWindowRenderer

from .context import check_version

TITLE = "mitsuba-diffraction"


class PanelWindow(moderngl_window.WindowConfig):
    """The window. The panel is told of all events that a subclass leaves alone.

    Attributes
    ----------
    panel : draws what ImGui was told, and takes events.

    Raises
    ------
    DiffractionError
        If the driver has no OpenGL 3.3.
    """

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        check_version(self.ctx)
        imgui.create_context()
        imgui.get_io().set_ini_filename("")  # leave no file behind
        self.panel = ModernglWindowRenderer(self.wnd)

    def say(self, text: str) -> None:
        """The panel with one line alone, on an empty picture."""
        self.wnd.fbo.clear(0.02, 0.02, 0.02)
        imgui.new_frame()
        imgui.begin(TITLE)
        imgui.text(text)
        imgui.end()
        self.show_panel()

    def show_panel(self) -> None:
        """Draw what ImGui was told since its last new frame."""
        imgui.render()
        self.wnd.use()
        self.panel.render(imgui.get_draw_data())

    def on_mouse_position_event(self, x: int, y: int, dx: int, dy: int) -> None:
        """For the panel."""
        self.panel.mouse_position_event(x, y, dx, dy)

    def on_mouse_press_event(self, x: int, y: int, button: int) -> None:
        """For the panel."""
        self.panel.mouse_press_event(x, y, button)

    def on_mouse_release_event(self, x: int, y: int, button: int) -> None:
        """For the panel."""
        self.panel.mouse_release_event(x, y, button)

    def on_unicode_char_entered(self, char: str) -> None:
        """For the panel."""
        self.panel.unicode_char_entered(char)

    def on_resize(self, width: int, height: int) -> None:
        """For the panel."""
        if hasattr(self, "panel"):
            self.panel.resize(width, height)
