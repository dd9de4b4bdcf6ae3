from .actuators import actuator_checks
from .bearing_axes import check_bearings, check_response_bearings
from .calibration import calibration_checks, in_sockets
from .drive_gains import gain_checks
from .dynamics import (
    LARGE,
    TOO_LARGE,
    check_base,
    check_bodies,
    check_external,
    check_fit,
    check_joints,
    check_shown,
    check_unseen_torques,
    check_weight,
    check_weight_shares,
    dynamics_checks,
    held_out_recordings,
)
from .elastic_model import check_misfit, check_responses, misfit_document, misfit_sentences, read_misfit
from .excitation import excitation_checks
from .fleet import fleet_checks
from .fleet_prior import check_fleet
from .inclinations import inclination_checks
from .measured_responses import limit_of, response_checks, worst_pose
from .payload import BODILESS, UNLIKE, payload_checks
from .places import check_places
from .pose_errors import (
    check_claimed_uncertainty,
    check_drift,
    check_enough,
    check_error_budget,
    check_flanks,
    check_fresh_poses,
    check_held_out,
    check_held_out_tilts,
    check_known_points,
    check_left_out,
    check_outliers,
    check_rank,
    check_residual,
    check_setup_unchanged,
    check_springs,
    check_truth,
    check_unseen,
)
from .predicted_errors import check_improvement, prediction_checks
from .verdict import ANSWERS, Trust, verdict_answer
from .verification import verification_checks

__all__ = [
    "ANSWERS",
    "BODILESS",
    "LARGE",
    "TOO_LARGE",
    "UNLIKE",
    "Trust",
    "actuator_checks",
    "calibration_checks",
    "check_base",
    "check_bearings",
    "check_bodies",
    "check_claimed_uncertainty",
    "check_drift",
    "check_enough",
    "check_error_budget",
    "check_external",
    "check_fit",
    "check_flanks",
    "check_fleet",
    "check_fresh_poses",
    "check_held_out",
    "check_held_out_tilts",
    "check_improvement",
    "check_joints",
    "check_known_points",
    "check_left_out",
    "check_misfit",
    "check_outliers",
    "check_places",
    "check_rank",
    "check_residual",
    "check_response_bearings",
    "check_responses",
    "check_setup_unchanged",
    "check_shown",
    "check_springs",
    "check_truth",
    "check_unseen",
    "check_unseen_torques",
    "check_weight",
    "check_weight_shares",
    "dynamics_checks",
    "excitation_checks",
    "fleet_checks",
    "gain_checks",
    "held_out_recordings",
    "in_sockets",
    "inclination_checks",
    "limit_of",
    "misfit_document",
    "misfit_sentences",
    "payload_checks",
    "prediction_checks",
    "read_misfit",
    "response_checks",
    "verdict_answer",
    "verification_checks",
    "worst_pose",
]
