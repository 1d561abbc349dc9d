"""Random cases from one seed: surfaces, damaged files and command lines.

Contents
--------
surfaces       height fields built, saved, loaded, looked up in NumPy and in the plugin
damage         files of tables, heights, recipes, meshes, plans and scenes with random damage
orders         files of solved orders with random damage
energy         scales, layers, speckle and nested light in a white furnace
command_lines  random arguments of every command

`python -m tests.fuzz --seconds 60` prints its seed and how to repeat each failure; a case that
failed once goes into test_fuzz.py.
"""
