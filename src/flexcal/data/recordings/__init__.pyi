from .command_log import CommandLog, read_command_log
from .decimation import Decimation, DecimationStream
from .joint_log import Recording, RecordingLabel
from .log_files import FILL, read_recording, read_recording_blocks, write_recording
from .low_pass import LowPass, TooFewSamples
from .sample_times import LATE
from .time_base import TimeBase, uniform_blocks
from .time_summary import TimeSummary

__all__ = [
    "FILL",
    "LATE",
    "CommandLog",
    "Decimation",
    "DecimationStream",
    "LowPass",
    "Recording",
    "RecordingLabel",
    "TimeBase",
    "TimeSummary",
    "TooFewSamples",
    "read_command_log",
    "read_recording",
    "read_recording_blocks",
    "uniform_blocks",
    "write_recording",
]
