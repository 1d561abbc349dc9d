"""The BSDF plugins and their parts (Dr.Jit).

Contents
--------
diffraction     `Diffraction`, the plugin that reflects; its docstring is docs/parameters.md
transmission    the plugin `diffraction_dielectric`, which lets light through as well
orders          the plugin `diffraction_orders`: gratings whose orders were solved
surface         `DiffractingSurface`, a table with factors, orientation and power
description     record of a surface that shaders, OSL, maps and plans read
depth_weights   weights by the depth of solved gratings
diffraction_mix  the plugin `diffraction_mix`: several surfaces in one, by weights
lifecycle       `PluginBSDF`, the base of all: answers, parameters and their changes, text
nesting         `NestingBSDF`, a BSDF over a nested one
arithmetic      Dr.Jit's arithmetic, for the formulas of `optics`
presets         named looks: a patch with its material and layers, by name
registration    registration of the plugins in every variant
dictionary      `bsdf_dict`: from arrays
llvm            an LLVM that Dr.Jit survives
diffraction_parameters  parameters of `diffraction`, read from Mitsuba's Properties and checked
surface_parameters  parameters that both plugins have: the surface and its table
stack           a stack of layers on the structure: its file and its table
support         features that go together, declared by each choice of a scene
meshes          arrays of Mitsuba's meshes, of 3.9 and 3.10
properties      words, flags and numbers from them, refused by name; what elements are called
layer_parameters  material, coat and film
pigment         pigment beneath a structure, of a colour or a measured spectrum
parameter_changes  changeable parameters, their checks; what `dr.freeze` must know of a BSDF
sources         table of a scene's heights, recipe or file, built once
factors         factors on heights and on lengths in the plane: numbers, textures, attributes
textures        orientation that varies; whether a mesh has what its BSDF reads
types           names of the types of arguments
directions      a pair of directions in the patch's frame, and how V-shaped grooves shadow it
power           the diffracted power at single wavelengths
device_table    a table inside a kernel: `DeviceTable`
sampling        directions drawn where the orders are
loops           sums in a loop inside a kernel, which derivatives pass
series          series in κ: weights of a bin's terms, and order 0
rgb             power and look-up in the RGB variants' colours
window_positions  where on the patch the window sits at a point of the surface
energy_factors  factors on heights and lengths for which scales of energy are tabulated
energy          the bound of the albedo that conserves energy
direction_lookup  tabulated functions of direction inside a kernel
boundary        reflected amplitude of the material, with its polarisation
conductors      optical constants of conductors in Mitsuba's tables
fresnel         what dielectric, conductor or mirror reflect; fields at an interface or a film
layers          a clear coat, a thin film, and the light that reaches a nested BSDF
memory          arrays in the variant's memory, and reading them
"""
