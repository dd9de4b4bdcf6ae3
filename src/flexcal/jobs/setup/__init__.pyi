from .measurement_import import ImportedFile, import_file
from .motor_readings import MotorReadings
from .point_declaration import write_point_position
from .robot_description import init_robot
from .signals_declaration import add_signals

__all__ = [
    "ImportedFile",
    "MotorReadings",
    "add_signals",
    "import_file",
    "init_robot",
    "write_point_position",
]
