"""`flexcal VERB …`: finds the verb, runs it, and turns known errors into one line and an exit status."""

from __future__ import annotations

import atexit
import gc
import io
import os
import shutil
import signal
import sys
import textwrap
from collections.abc import Sequence
from contextlib import redirect_stderr, suppress
from pathlib import Path

from flexcal.cli.arguments.invocation import record_command_line
from flexcal.cli.arguments.verb_table import Verb, command_class, find_verb, overview, unknown_verb
from flexcal.cli.terminal.encoding import substitute_unencodable
from flexcal.cli.terminal.standard_streams import buffered_output, replace_closed_streams
from flexcal.cli.terminal.stop_signals import StopSignal, noted_stop_signals
from flexcal.errors import FlexcalError
from flexcal.printable import sentence

FAILED = 2
INTERRUPTED = 130
_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3
"""Numbers of parameters of the C library's memory, as in its malloc.h."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command line (default: that of the process) and return its exit status.

    0: done; 2: an input or argument that cannot be used, one sentence on standard error; 130: interrupted, 143 and 129: stopped by SIGTERM
    or SIGHUP, one sentence too.
    """
    replace_closed_streams()
    given = list(sys.argv[1:] if arguments is None else arguments)
    # matrices here are small: threads of the linear algebra library cost more than they give
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # what a verb imports and reads stays until its end: looking through it for cycles every 700 objects finds none; loading makes 200 000
    gc.set_threshold(300_000)
    atexit.register(gc.freeze)  # nor does it at exit, which took a tenth of a second
    substitute_unencodable()
    with noted_stop_signals() as stopping:
        try:
            stopping.begin()
            with buffered_output():
                status = _run(given)
            stopping.end()
            return status
        except BaseException as problem:
            stopping.end()
            told, status = _told(problem, stopping)
            with suppress(OSError):
                print(f"flexcal: {told}", file=sys.stderr)
            return status


def _told(problem: BaseException, stopping: StopSignal) -> tuple[str, int]:
    """Message of an exception in one line, and the exit status; unexpected exceptions are raised again."""
    if stopping.number is not None:  # an extension module that is interrupted raises what it likes
        return sentence(stopping.sentence), stopping.status
    error = _user_error(problem)
    if error is not None:
        return f"{sentence(error)} [{error.code}]", FAILED
    if _was_interrupted(problem):
        return StopSignal(signal.SIGINT).sentence, INTERRUPTED
    raise problem


def _user_error(problem: BaseException) -> FlexcalError | None:
    """The exception as an error that the user can correct; None where it is none."""
    if isinstance(problem, FlexcalError):
        return problem
    if isinstance(problem, FileNotFoundError) and problem.filename is None and not _folder_is_there():
        return FlexcalError("E-CLI-015", "the current folder has been removed; change to one that is there.")
    if isinstance(problem, MemoryError):
        what = f" ({problem})" if str(problem) else ""
        return FlexcalError(
            "E-CLI-016",
            f"there is not enough memory{what}; give fewer rows or logs, or take a machine with more.",
        )
    if isinstance(problem, OSError):
        where = f"{problem.filename}: " if problem.filename else ""
        return FlexcalError("E-CLI-017", f"{where}{problem.strerror or problem}.")
    return None


def _folder_is_there() -> bool:
    try:
        return bool(os.getcwd())
    except OSError:
        return False


def _run(arguments: list[str]) -> int:
    record_command_line(arguments)
    if not arguments or arguments[0] in ("-h", "--help", "help"):
        print(overview())
        return 0
    if arguments[0] in ("-V", "--version"):
        from flexcal import __version__

        print(f"flexcal {__version__}")
        return 0
    verb = find_verb(arguments)
    if verb is None:
        if len(arguments) > 1 and arguments[1] in ("-h", "--help") and f"\n  {arguments[0]} " in overview():
            print(overview(arguments[0]))
            return 0
        raise unknown_verb(arguments)
    return _carry_out(verb, arguments[len(verb.words) :])


def _was_interrupted(problem: BaseException | None) -> bool:
    """Whether Ctrl-C is behind an exception: an extension module that is interrupted at import raises ImportError from it."""
    while problem is not None and not isinstance(problem, KeyboardInterrupt):
        problem = problem.__cause__
    return problem is not None


def _carry_out(verb: Verb, arguments: list[str]) -> int:
    import tyro

    from flexcal.cli.arguments.parse_errors import parse_error, refuse_unknown_options
    from flexcal.cli.arguments.verb_options import check_ranges
    from flexcal.cli.folders.overwrite_protection import outputs

    _keep_freed_memory()
    command = command_class(verb)
    refuse_unknown_options(verb, arguments)
    said = io.StringIO()
    try:
        with redirect_stderr(said):
            parsed = tyro.cli(
                command,
                prog=f"flexcal {verb.name}",
                args=arguments,
                config=(tyro.conf.FlagCreatePairsOff,),
                description=_description(command.__doc__ or "", verb.example),
            )
    except SystemExit as stop:
        if stop.code == 0:  # --help
            return 0
        raise parse_error(verb, said.getvalue()) from None
    check_ranges(verb, parsed)
    if verb.interactive:
        parsed.run()
        return 0
    if any(isinstance(value, Path) and not value.is_absolute() for value in vars(parsed).values()):
        os.getcwd()  # raises where it has been removed
    leaves = getattr(parsed, "leaves", verb.leaves)
    is_named = any(argument.partition("=")[0] == "--out" for argument in arguments)
    with outputs(verb.name, parsed.out, leaves, page=verb.page, beside=verb.beside, is_named=is_named):
        refusal = parsed.run()
    if refusal is not None:  # of a part of what was asked: the rest is written
        raise refusal
    return 0


def _keep_freed_memory() -> None:
    """Let the C library of Linux keep up to 256 MB that were freed, and arrays below 32 MB, the most it takes, beside others.

    By default it gives such memory back at once, and the next array costs a page fault every 4 KB: a quarter of the time of a calibration
    of thousands of points. What a user has set stays.
    """
    import ctypes

    if any(name.startswith("MALLOC_") or name == "GLIBC_TUNABLES" for name in os.environ):
        return
    with suppress(AttributeError, OSError, TypeError):  # others have no mallopt
        library = ctypes.CDLL(None)
        library.mallopt(_MMAP_THRESHOLD, 32 << 20)
        library.mallopt(_TRIM_THRESHOLD, 632 << 20)


def _description(docstring: str, example: str) -> str:
    """The paragraphs of a docstring, filled to the terminal, and an example."""
    width = min(shutil.get_terminal_size().columns, 100)
    paragraphs = [textwrap.fill(" ".join(part.split()), width) for part in docstring.split("\n\n")]
    return "\n\n".join([*paragraphs, f"Example: {example}"])


if __name__ == "__main__":
    sys.exit(main())
