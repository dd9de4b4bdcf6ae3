from .description_check import FileProblem, description_problems
from .description_editing import edit_robot
from .measurement_import import ImportedFile, import_file
from .motor_readings import MotorReadings
from .nominal_robot import urdf_robot
from .point_declaration import write_point_position
from .robot_description import init_robot
from .signals_declaration import add_signals

__all__ = [
    "FileProblem",
    "ImportedFile",
    "MotorReadings",
    "add_signals",
    "description_problems",
    "edit_robot",
    "import_file",
    "init_robot",
    "urdf_robot",
    "write_point_position",
]
