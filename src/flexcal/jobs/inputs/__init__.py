"""Input of jobs: the robot with its stored estimates, plans, frequency responses, and checks of such files."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
