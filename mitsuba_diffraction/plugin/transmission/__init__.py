"""Light that goes through a dielectric, or through a thin sheet with one structured side (Dr.Jit).

Contents
--------
diffraction_dielectric  `DiffractionDielectric`, the plugin; its docstring describes its parameters
dielectric_parameters   read from Mitsuba's Properties, checked
crossing                pairs of directions not both above the surface, and their Jones matrices
energy                  scales of directions by which reflected and transmitted light add up to 1
"""
