"""The errors that flexcal raises on purpose."""


class FlexcalError(Exception):
    """Anything that went wrong for a reason the user can act on; the message is one sentence that says what, where and what to do."""


class InputError(FlexcalError):
    """A file or argument that cannot be used as it is; the message names the file, and line, column or joint where there is one."""
