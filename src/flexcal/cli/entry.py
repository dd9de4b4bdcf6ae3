"""The program `flexcal`, as it is installed."""


def run() -> int:
    """Run the command line of the process."""
    from flexcal.cli.main import main

    return main()
