"""Three-dimensional scene of the studio: robot, measurements and volumes, drawn with viser.

Every class takes a `viser.SceneApi` and puts its nodes below one name. Lengths are in metres in the robot's base frame. Node names are
made of numbers, never of names from files, which could contain the separator of viser's tree.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
