"""Spectra of an excited axis, and the reference that separates excitation from feedback."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexcal.frequency.arbitrary import (
    ExcitationRecord,
    Feedback,
    Hold,
    RecordSpectra,
    equal_pieces,
    excited_band,
    feedback,
    find_period,
    local_response,
    record_spectra,
    with_reference,
)
from flexcal.importing.columns import ResponseRecords
from flexcal.jobs.response.feedback import MOSTLY, line_noise_share, references_free_of_feedback

_NARROW = 0.5
"""Share of the band without a reference that a recognised, not named, reference must explain."""


@dataclass(frozen=True, eq=False)
class ExcitationSpectra:
    """Spectra of the records `measured` in `pieces` of equal length: the `whole` spectra, their `usable` bins (K,; None for all), the
    feedback of their `loop`, and the `period` of the excitation in samples.
    """

    measured: ResponseRecords
    pieces: list[ExcitationRecord]
    whole: RecordSpectra
    usable: np.ndarray | None
    loop: Feedback | None
    period: int | None

    @property
    def width_hz(self) -> float:
        """Width of the excited band; zero if there is none."""
        band = excited_band(self.whole, local_response(self.whole), self.usable)
        return 0.0 if band is None else band[1] - band[0]


def measure_spectra(measured: ResponseRecords, hold: Hold) -> ExcitationSpectra:
    """Spectra with the named references; recognised ones are used only if a controller acts and they explain the input."""
    pieces = equal_pieces(measured.records)
    at_once = [channel.derivative == 2 for channel in measured.outputs]
    loop = feedback(pieces, at_once)
    if not measured.guessed:
        return _spectra(measured, hold, loop)
    names = " and ".join(channel.name for channel in measured.references)
    if loop is None or not loop.acts:
        return _spectra(measured.without_references(f"left out: {names} (no controller is seen)"), hold, loop)
    plain = measured.without_references(
        f"{names} is called like a reference, but seems to carry noise of the output, and is left out; --reference uses it"
    )
    if not references_free_of_feedback(pieces, at_once):
        return _spectra(plain, hold, loop)
    plain = measured.without_references(
        f"{names} is called like a reference, but explains the input in a small part of the band, and is left out; --reference uses it"
    )
    explained, direct = _spectra(measured, hold, loop), _spectra(plain, hold, loop)
    return direct if explained.width_hz < _NARROW * direct.width_hz else explained


def _spectra(measured: ResponseRecords, hold: Hold, loop: Feedback | None) -> ExcitationSpectra:
    pieces = equal_pieces(measured.records)
    periodic = [find_period(r.references if r.references.size else r.inputs) for r in pieces]
    period = periodic[0] if len(set(periodic)) == 1 else None
    whole, references = record_spectra(pieces, measured.inputs, measured.outputs, hold=hold, period=period)
    usable = None
    if measured.references:
        whole, usable = with_reference(whole, references)
    elif loop is not None and loop.acts:
        usable = line_noise_share(loop.share_at(whole.frequencies_hz), whole.periods) < MOSTLY
    return ExcitationSpectra(measured, pieces, whole, usable, loop, period)
