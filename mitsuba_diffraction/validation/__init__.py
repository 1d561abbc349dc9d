"""How far the model can be trusted: rigorous solutions, closed forms and statistics beside it.

Not needed to use the package. `python -m mitsuba_diffraction.validation report` writes
docs/validation.md from the solutions that come with the package; `solve` makes those anew, which
needs the extra `validation`.
"""
