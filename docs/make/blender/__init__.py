"""Programs that render the same scene in Blender's Cycles and in Mitsuba, and compare the pictures.

Contents
--------
views     small scenes: a shape, a surface, a light and a camera, for both renderers
program   Blender as a separate process
inside    build and render a view in Blender; imports nothing of the package
showcase  build the example .blend in Blender; imports nothing of the package
compare   ΔE2000 between the two renderers, and the part that is noise
"""
