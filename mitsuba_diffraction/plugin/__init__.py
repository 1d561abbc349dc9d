"""The BSDF plugins and their parts (Dr.Jit).

Contents
--------
diffraction     `Diffraction`, the plugin that reflects; its docstring is docs/parameters.md
diffraction_dielectric  the plugin `diffraction_dielectric`, which lets light through as well
diffraction_mix  the plugin `diffraction_mix`: several surfaces in one, by weights
weights         its weights, given or by the depth of solved gratings
base            `PluginBSDF`, answers, parameters and their changes; `SurfaceBSDF`, the one `sample`
surface         `DiffractingSurface`, a table with factors, orientation and power
description     record of a surface that shaders, OSL, maps and plans read
parameters      parameters of a scene, read from Mitsuba's Properties and checked
properties      words, flags, numbers and files from them, refused by name
varying         numbers over a surface: one for all, a texture or a mesh attribute
textures        orientation that varies, and checks of textures
parameter_changes  changeable parameters, their checks; what `dr.freeze` must know of a BSDF
sources         table of a scene's heights, recipe or file, built once
presets         presets: a patch with its material and layers, by name
registration    registration of the plugins in every variant
installed       Mitsuba's own plugins and tables, before files of the same names beside a scene
dictionary      `bsdf_dict`: from arrays
directions      pairs of directions in the patch's frame: above, in a coat, below, through
boundary        reflected amplitude of the material, with its polarisation
materials       dielectric, conductor or mirror: their indices, and what follows from them
layers          a clear coat and a thin film, materials over a material
stack           a stack of layers on the structure: its file and its table
conductors      optical constants of conductors in Mitsuba's tables
pigment         pigment beneath a structure, of a colour or a measured spectrum
power           the diffracted power at single wavelengths
rgb             power and look-up in the RGB variants' colours
device_table    a table inside a kernel: `DeviceTable`
height_derivatives  a table's coefficients as functions of the heights in `data`
series          series in κ: weights of a bin's terms, and order 0
sampling        directions drawn where the orders are
window_positions  where on the patch the window sits at a point of the surface
energy          scales of directions that conserve energy, and the light that goes beneath
energy_factors  factors on heights and lengths for which scales of energy are tabulated
direction_lookup  tabulated functions of direction inside a kernel
arithmetic      Dr.Jit's arithmetic, for the formulas of `optics`
memory          arrays in the variant's memory, and reading them
loops           sums in a loop inside a kernel, which derivatives pass
types           names of the types of arguments
"""

import mitsuba  # noqa: F401 - before the modules here: the import registers them (`when_imported`)

__all__ = [
    "arithmetic", "base", "boundary", "conductors", "description", "device_table", "dictionary",
    "diffraction", "directions", "installed", "loops", "memory", "parameter_changes",
    "parameters", "pigment", "presets", "properties", "registration", "sampling", "sources",
    "textures", "types",
]  # fmt: skip
