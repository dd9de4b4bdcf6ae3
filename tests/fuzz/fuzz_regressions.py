"""Broken files that once ended in a traceback, a crash or words that were no sentence, and the command lines that read them."""

from __future__ import annotations

_TABLE = """
robot.yaml: export urdf robot.yaml --out new.urdf
  open_lists_100000_deep lists_100000_deep mappings_100000_deep dashes_100000_deep lists_500_deep alias_bomb alias_mappings
  payload_com_0_digits payload_com_0_octal payload_com_0_long_hexadecimal key_escape key_megabyte
robot.yaml: measure plan.yaml --cell virtual --robot robot.yaml --config cell.yaml --out new
  points_digits
arm.urdf: init arm.urdf --out new
  number_10_long_hexadecimal
arm.urdf: export urdf robot.yaml --out new.urdf
  declared_x-unknown declared_shift_jis encoded_utf-16 100000_deep 1100_joints 1100_fixed_joints link_named_as_joint
poses.csv: calibrate robot.yaml poses.csv --terms kinematic --out new
  cr_only header_2_megabyte
poses.csv: import robot.yaml poses.csv --out new.csv
  line_1_column_7_comma column_0_all_int64 line_1_column_5_huge
others.csv: verify robot.yaml others.csv
  header_7_escape
others.csv: map robot.yaml --verification others.csv --count 20 --out new.html
  column_0_all_huge line_1_column_4_long_hexadecimal one_row
visits.csv: repeatability robot.yaml visits.csv
  nul_inside column_5_all_huge
commands.csv: predict robot.yaml commands.csv --out new.csv
  header_2_megabyte line_1_column_4_megabyte
cell.yaml: measure plan.yaml --cell virtual --robot robot.yaml --config cell.yaml --out new
  spread_com_huge spread_stiffness_int64 mismatch_hysteresis_huge number_7_tiny mismatch_elastic_wrist_tiny
frequency/plan.yaml: identify response robot.yaml frequency --out new
  kind_lists
results/points.csv: report results
  line_30_column_0_huge header_3_format header_5_empty line_1_column_7_quote header_7_megabyte line_1_column_10_megabyte_text
  line_1_column_19_huge column_22_all_escape
responses/response_pose_1.npz: identify stiffness robot.yaml responses --out new
  payload_infinite frequencies_hz_nan covariance_dates degrees_of_freedom_dates joints_boolean payload_texts sample_time_texts
  q_mean_shorter
results/arm.npz: report results
  errors_calibrated_huge corners_deeper header_terabytes
plan.yaml: measure plan.yaml --cell virtual --robot robot.yaml --config cell.yaml --out new
  lines_0_int64 number_6_huge number_8_int64 base_frequency_hz_tiny
responses/plan.yaml: identify stiffness robot.yaml responses --out new
  number_10_tiny
frequency/truth.yaml: measure plan.yaml --cell virtual --robot robot.yaml --config cell.yaml --out new --truth frequency/truth.yaml
  dynamics_values_lower.com_z_huge dynamics_values_lower.com_x_estimate_int64 number_3_tiny
verification/results.json: report verification --customer
  rms_mm_parameters_text verification_measured_null refit_proposed_nested prediction_freedom_null remarks_true
responses/results.json: report responses
  responses_huge responses_0_file_nested responses_0_highest_hz_odd provenance_int64
results/gravity_loads.npz: report results
  bytes_2 along_rigid_empty along_calibrated_shorter
measured.uff: import robot.yaml measured.uff --out new.csv
  last_end_gone line_8_field_3_infinite line_8_field_4_huge line_8_field_1_minus
measured.uff: identify response --input tau1 --output q1 --out new measured.uff
  last_end_gone line_8_field_3_infinite line_8_field_4_huge line_8_field_1_minus
log.csv: identify response --input tau1 --output q1 --out new log.csv
  line_1_column_4_huge line_1_column_5_minus_huge line_1_column_6_digits line_1_column_4_underscore
poses.csv: design poses robot.yaml --from poses.csv --count 5 --out new.yaml
  two_rows
robot.yaml: calibrate robot.yaml poses.csv --terms kinematic --out new
  prior_mass_tiny
results/.flexcal: calibrate robot.yaml poses.csv --terms kinematic --out results
  a_program
"""
"""A file and a command line; indented below, names of mutations."""


def regressions() -> list[tuple[str, str, str]]:
    """File, mutation and command line of each."""
    found, file, line = [], "", ""
    for row in _TABLE.strip().splitlines():
        if row.startswith(" "):
            found += [(file, label, line) for label in row.split()]
        else:
            file, _, line = row.partition(": ")
    return found
