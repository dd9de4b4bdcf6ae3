"""Calibration of industrial robots: public names, imported on first use."""

import os
import signal
import sys

__version__ = "0.1.0"

_program = os.path.basename("".join(sys.argv[:1])).removesuffix(".exe") == "flexcal"
if _program and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it quietly while it loads, and when it is done

import lazy_loader  # noqa: E402

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
