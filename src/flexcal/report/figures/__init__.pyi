from .accuracy_map import SHOWN, accuracy_space, accuracy_views, variance_shares
from .drift_sums import cumulative_sums, visit_errors
from .error_distributions import error_distribution, error_histogram, predicted_quantiles
from .estimated_parameters import (
    correlation_map,
    parameter_bars,
    shown_parameters,
    singular_values,
    spring_intervals,
    term_label,
    term_scores,
)
from .fleet import fleet_errors, trend_courses
from .frequency_plan import amplitude_spectrum, planned_arm, poses_against_std, predicted_springs
from .frequency_responses import bode, response_fit, response_levels, sensor_fit
from .learning_curve import learning_curves
from .moved_tool import tool_displacement
from .pose_errors import ErrorSeries, calibration_errors, error_components, pose_courses, verification_errors
from .pose_plan import joint_positions, plan_space, pose_numbers
from .residuals import (
    error_field,
    loaded_joints,
    residual_joints,
    residual_torque,
    residual_trend,
    residual_workspace,
)
from .robot_arm import arm_poses, links_at
from .study_distributions import interval_coverage, level_distributions, task_distribution
from .temperature import residual_growth
from .tilts import tilt_joints, tilt_order
from .tool_path import program_path
from .torques import torque_spectra, torque_traces
from .trajectory_plan import limit_shares, prior_gains, swept_paths

__all__ = [
    "SHOWN",
    "ErrorSeries",
    "accuracy_space",
    "accuracy_views",
    "amplitude_spectrum",
    "arm_poses",
    "bode",
    "calibration_errors",
    "correlation_map",
    "cumulative_sums",
    "error_components",
    "error_distribution",
    "error_field",
    "error_histogram",
    "fleet_errors",
    "interval_coverage",
    "joint_positions",
    "learning_curves",
    "level_distributions",
    "limit_shares",
    "links_at",
    "loaded_joints",
    "parameter_bars",
    "plan_space",
    "planned_arm",
    "pose_courses",
    "pose_numbers",
    "poses_against_std",
    "predicted_quantiles",
    "predicted_springs",
    "prior_gains",
    "program_path",
    "residual_growth",
    "residual_joints",
    "residual_torque",
    "residual_trend",
    "residual_workspace",
    "response_fit",
    "response_levels",
    "sensor_fit",
    "shown_parameters",
    "singular_values",
    "spring_intervals",
    "swept_paths",
    "task_distribution",
    "term_label",
    "term_scores",
    "tilt_joints",
    "tilt_order",
    "tool_displacement",
    "torque_spectra",
    "torque_traces",
    "trend_courses",
    "variance_shares",
    "verification_errors",
    "visit_errors",
]
