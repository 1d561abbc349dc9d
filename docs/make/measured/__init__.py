"""Writer of docs/validation/measured.md: measured gratings beside the model and solved orders.

Contents
--------
data        measurements with their sources and licences
grooves     groove profiles from the angles that an engineer knows
predict     orders of one mount by the model and by a solver
cases       measurements, what is known of each grating, and what is fitted
shapes      what each imperfection of a groove does to its orders
outside     height maps and pictures of another wave-optics renderer
page        tables and figures; page.txt has the words
"""
