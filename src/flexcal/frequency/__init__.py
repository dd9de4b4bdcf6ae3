"""From recordings of multisine experiments to frequency response matrices with their covariances."""

from flexcal.frequency.averages import Average
from flexcal.frequency.local_polynomial import local_polynomial_responses
from flexcal.frequency.multisine import (
    crest_factor,
    half_integer_frequency,
    leave_out_detection_lines,
    odd_lines,
    optimise_crest,
    orthogonal_matrix,
    reference,
    spectra,
    torque,
)
from flexcal.frequency.response import FrequencyResponse, frequency_response, frequency_responses
from flexcal.frequency.spectrum import noise_lines, spectrum

__all__ = [
    "Average",
    "FrequencyResponse",
    "crest_factor",
    "frequency_response",
    "frequency_responses",
    "half_integer_frequency",
    "leave_out_detection_lines",
    "local_polynomial_responses",
    "noise_lines",
    "odd_lines",
    "optimise_crest",
    "orthogonal_matrix",
    "reference",
    "spectra",
    "spectrum",
    "torque",
]
