from .candidate_poses import PoseRequest, PoseRequestFiles, box_corners, working_file, working_volume
from .excitation_export import export_excitation
from .frequency_design import (
    DesignedFrequency,
    FrequencyRequest,
    design_frequency,
    plan_frequency_experiments,
)
from .measurement import measure
from .next_poses import DesignedNextPoses, design_next_poses, plan_next_poses
from .optimised_excitation import PlanName, optimise_excitation, plan_without_poses, response_sensors
from .poses import DesignedPoses, design_poses, plan_calibration_poses, plan_verification_poses
from .standard_plans import frequency_plan
from .trajectories import (
    DesignedTrajectories,
    TrajectoryRequest,
    design_trajectories,
    exciting_plan,
    plan_trajectories,
)

__all__ = [
    "DesignedFrequency",
    "DesignedNextPoses",
    "DesignedPoses",
    "DesignedTrajectories",
    "FrequencyRequest",
    "PlanName",
    "PoseRequest",
    "PoseRequestFiles",
    "TrajectoryRequest",
    "box_corners",
    "design_frequency",
    "design_next_poses",
    "design_poses",
    "design_trajectories",
    "exciting_plan",
    "export_excitation",
    "frequency_plan",
    "measure",
    "optimise_excitation",
    "plan_calibration_poses",
    "plan_frequency_experiments",
    "plan_next_poses",
    "plan_trajectories",
    "plan_verification_poses",
    "plan_without_poses",
    "response_sensors",
    "working_file",
    "working_volume",
]
