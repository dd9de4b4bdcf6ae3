"""Strict conversion of plain data (dicts, lists, texts, numbers) to frozen dataclasses, by cattrs.

A Boolean or a text is never a number, NaN, infinity and numbers beyond `units.LARGEST` are refused, whole numbers have at
most 8 bytes, an unknown key is refused with the nearest known one. Arrays (`numpy.ndarray`, `NDArray[np.int64]`) are
rectangular nested lists of numbers. Of a union, the members that have the form of the value (mapping, list or scalar) are
tried in order, dataclasses that know more of its keys later.
"""

from flexcal.plain_data.converter import structure
from flexcal.plain_data.keys import dotted, file_key
from flexcal.plain_data.misfits import MisfitError
from flexcal.plain_data.wording import suggestion

__all__ = ["MisfitError", "dotted", "file_key", "structure", "suggestion"]
