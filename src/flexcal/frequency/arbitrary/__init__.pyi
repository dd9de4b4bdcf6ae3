from .band import excited_band
from .excitation_record import SHORTEST, Channel, ExcitationRecord, equal_pieces
from .feedback_bias import Feedback, feedback
from .instruments import with_reference
from .nonparametric import LocalResponse, local_response, local_window
from .period_detection import find_period
from .repeatability import HalfDifference, half_difference
from .spectra import Hold, RecordSpectra, record_spectra
from .tone_detection import Tones, detect_tones

__all__ = [
    "SHORTEST",
    "Channel",
    "ExcitationRecord",
    "Feedback",
    "HalfDifference",
    "Hold",
    "LocalResponse",
    "RecordSpectra",
    "Tones",
    "detect_tones",
    "equal_pieces",
    "excited_band",
    "feedback",
    "find_period",
    "half_difference",
    "local_response",
    "local_window",
    "record_spectra",
    "with_reference",
]
