"""Measurements of surfaces, tables and scenes.

Contents
--------
export         files of a BRDF for other programs
maps           BRDF maps over the hemisphere of view directions
spectra        reflectance spectra as a spectrometer measures them
spectrometer   angles of lamp and detectors, and the detectors' cones
media          clear media above a surface, and their index over wavelength
spectra_files  CSV, colours and plot of spectra
observers      eyes of animals: sensitivities, quantum catches, contrasts
false_colour   pictures of an eye's quantum catches
spectral_variables  variables of spectra as biologists publish them
angular_variables  variables of iridescence over angles (Gruson and others 2019)
known_wavelengths  wavelengths at which a material, a pigment and a table are known
crops          crops of one scan
scans          tables and BSDFs of scans and recipes
survey         table, map and statistics of many scans
treatments     options of a survey by patterns of file names
repeats        files of a survey, and means over repeated scans of a sample
survey_files   rows of a survey as CSV, and contact sheets
iridescence    colours of the diffracted light, and how much they change with direction
tradeoff       accuracy against speed and memory
timing         kernel times, measured in alternating rounds
machine        description of the machine that measures
pictures       pictures of patches and of raw albedo
design         surfaces from their BRDF or colours, by gradients with respect to the heights
energy         albedo of a table's surface before and after energy conservation
"""

__all__ = [
    "angular_variables", "crops", "design", "energy", "false_colour", "iridescence",
    "known_wavelengths", "machine", "media", "observers", "pictures", "repeats", "scans",
    "spectra", "spectra_files", "spectrometer", "survey", "timing", "treatments",
]  # fmt: skip
