"""The realtime port in GLSL: shaders, what they read, and a renderer (extra `gl`)."""
