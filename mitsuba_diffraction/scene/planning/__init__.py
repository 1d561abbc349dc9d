"""Smaller tables for one scene: paths through it, look-ups on them, and limits that suffice.

Contents
--------
paths        paths through a scene, and the look-ups of its BSDFs on them
recording    loading with other tables, and with BSDFs that record their look-ups
lookups      how far the look-ups in one table go, with how much of the light
plan         limits of each table, as recipes, and loading a scene by them
report       requested range of a table and savings of its limits, as plain data
"""
