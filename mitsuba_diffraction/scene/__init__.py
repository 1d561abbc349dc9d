"""Scenes: loaded, rendered in passes, planned, and meshes that a patch can follow.

Contents
--------
load         a variant set and a scene loaded; what Mitsuba says, as lines of our own
parameters   names that -D may set, and values that change from frame to frame
passes       rendering in passes of samples; EXR and PNG of it
frames       frames of an animation, and a film of them
planning     the tables that suffice for a scene
orientation  directions that a patch follows over a mesh
"""
