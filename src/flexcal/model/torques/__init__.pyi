from .energies import energy_regressor
from .external_loads import declared_torque, sensor_jacobian, wrench_torque
from .inertial_regressor import (
    inertial_names,
    inertial_parameters,
    motion_batch,
    torque_regressor,
    write_torque_regressor,
)
from .regressor_adjoint import placed_regressor_adjoint, torque_regressor_adjoint

__all__ = [
    "declared_torque",
    "energy_regressor",
    "inertial_names",
    "inertial_parameters",
    "motion_batch",
    "placed_regressor_adjoint",
    "sensor_jacobian",
    "torque_regressor",
    "torque_regressor_adjoint",
    "wrench_torque",
    "write_torque_regressor",
]
