"""`python -m mitsuba_diffraction` is the command `mitsuba-diffraction`."""

import sys

from _mitsuba_diffraction import main

if __name__ == "__main__":
    sys.exit(main())
