"""The errors that flexcal raises on purpose."""


class FlexcalError(Exception):
    """An error that the user can correct; the message is one sentence that says what is wrong, where, and what to do."""


class InputError(FlexcalError):
    """A file or argument that cannot be used as it is; the message names the file, and line, column or joint where there is one."""
