"""The program `flexcal`, as it is installed."""

import signal


def run() -> int:
    """Run the command line of the process; Ctrl-C ends it quietly while it loads and when it is done, as there is nothing to tidy up."""
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from flexcal.cli.main import main

    return main()
