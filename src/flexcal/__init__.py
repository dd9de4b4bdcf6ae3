"""Calibration of industrial robots: public names, imported on first use."""

import os
import signal
import sys

_program = os.path.basename("".join(sys.argv[:1])).removesuffix(".exe") == "flexcal"
if _program and signal.getsignal(signal.SIGINT) is signal.default_int_handler:
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # Ctrl-C ends it quietly while it loads, and when it is done

import lazy_loader  # noqa: E402

_public_name, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("flexcal")
    return _public_name(name)
