"""Broken files that once ended in a traceback, a crash or words that were no sentence: kept by name, with the command line that failed."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from fuzz_cases import CALIBRATE, IMPORT, RESPONSE, SUBJECTS, VIRTUAL, Case, broken_contents

_EXPORT = "export urdf robot.yaml --out new.urdf"
_MEASURE = f"measure plan.yaml {VIRTUAL}"
_STIFFNESS = "identify stiffness robot.yaml responses --out new"
_CUSTOMER = "report verification --customer"
_MAP = "map robot.yaml --verification others.csv --count 20 --out new.html"
_IMPORT_POSES = f"{IMPORT} poses.csv"

REGRESSIONS: tuple[tuple[str, str, str], ...] = (
    ("robot.yaml", "open_lists_100000_deep", _EXPORT),
    ("robot.yaml", "lists_100000_deep", _EXPORT),
    ("robot.yaml", "mappings_100000_deep", _EXPORT),
    ("robot.yaml", "dashes_100000_deep", _EXPORT),
    ("robot.yaml", "lists_500_deep", _EXPORT),
    ("robot.yaml", "alias_bomb", _EXPORT),
    ("robot.yaml", "alias_mappings", _EXPORT),
    ("robot.yaml", "points_digits", _MEASURE),
    ("robot.yaml", "payload_com_0_digits", _EXPORT),
    ("robot.yaml", "payload_com_0_octal", _EXPORT),
    ("robot.yaml", "payload_com_0_long_hexadecimal", _EXPORT),
    ("robot.yaml", "key_escape", _EXPORT),
    ("robot.yaml", "key_megabyte", _EXPORT),
    ("arm.urdf", "number_10_long_hexadecimal", "init arm.urdf --out new"),
    ("arm.urdf", "declared_x-unknown", _EXPORT),
    ("arm.urdf", "declared_shift_jis", _EXPORT),
    ("arm.urdf", "encoded_utf-16", _EXPORT),
    ("arm.urdf", "100000_deep", _EXPORT),
    ("arm.urdf", "1100_joints", _EXPORT),
    ("arm.urdf", "1100_fixed_joints", _EXPORT),
    ("arm.urdf", "link_named_as_joint", _EXPORT),
    ("poses.csv", "cr_only", CALIBRATE),
    ("poses.csv", "line_1_column_7_comma", _IMPORT_POSES),
    ("poses.csv", "column_0_all_int64", _IMPORT_POSES),
    ("poses.csv", "line_1_column_5_huge", _IMPORT_POSES),
    ("poses.csv", "header_2_megabyte", CALIBRATE),
    ("others.csv", "header_7_escape", "verify robot.yaml others.csv"),
    ("others.csv", "column_0_all_huge", _MAP),
    ("others.csv", "line_1_column_4_long_hexadecimal", _MAP),
    ("visits.csv", "nul_inside", "repeatability robot.yaml visits.csv"),
    ("visits.csv", "column_5_all_huge", "repeatability robot.yaml visits.csv"),
    ("commands.csv", "header_2_megabyte", "predict robot.yaml commands.csv --out new.csv"),
    ("commands.csv", "line_1_column_4_megabyte", "predict robot.yaml commands.csv --out new.csv"),
    ("cell.yaml", "spread_com_huge", _MEASURE),
    ("cell.yaml", "spread_stiffness_int64", _MEASURE),
    ("frequency/plan.yaml", "kind_lists", "identify response robot.yaml frequency --out new"),
    ("results/points.csv", "line_30_column_0_huge", "report results"),
    ("cell.yaml", "mismatch_hysteresis_huge", _MEASURE),
    ("cell.yaml", "number_7_tiny", _MEASURE),
    ("responses/response_pose_1.npz", "payload_infinite", _STIFFNESS),
    ("results/arm.npz", "errors_calibrated_huge", "report results"),
    ("cell.yaml", "mismatch_elastic_wrist_tiny", _MEASURE),
    ("plan.yaml", "lines_0_int64", _MEASURE),
    ("plan.yaml", "number_6_huge", _MEASURE),
    ("plan.yaml", "number_8_int64", _MEASURE),
    ("plan.yaml", "base_frequency_hz_tiny", _MEASURE),
    ("responses/plan.yaml", "number_10_tiny", _STIFFNESS),
    ("frequency/truth.yaml", "dynamics_values_lower.com_z_huge", f"{_MEASURE} --truth frequency/truth.yaml"),
    (
        "frequency/truth.yaml",
        "dynamics_values_lower.com_x_estimate_int64",
        f"{_MEASURE} --truth frequency/truth.yaml",
    ),
    ("frequency/truth.yaml", "number_3_tiny", f"{_MEASURE} --truth frequency/truth.yaml"),
    *(
        ("responses/response_pose_1.npz", label, _STIFFNESS)
        for label in (
            *("frequencies_hz_nan", "covariance_dates", "degrees_of_freedom_dates", "joints_boolean"),
            *("payload_texts", "sample_time_texts", "q_mean_shorter"),
        )
    ),
    *(
        ("verification/results.json", label, _CUSTOMER)
        for label in (
            *("rms_mm_parameters_text", "verification_measured_null", "refit_proposed_nested"),
            *("prediction_freedom_null", "remarks_true"),
        )
    ),
    *(
        ("responses/results.json", label, "report responses")
        for label in (
            "responses_huge",
            "responses_0_file_nested",
            "responses_0_highest_hz_odd",
            "provenance_int64",
        )
    ),
    *(
        ("results/points.csv", label, "report results")
        for label in (
            *("header_3_format", "header_5_empty", "line_1_column_7_quote", "header_7_megabyte"),
            *("line_1_column_10_megabyte_text", "line_1_column_19_huge", "column_22_all_escape"),
        )
    ),
    ("results/arm.npz", "corners_deeper", "report results"),
    ("results/arm.npz", "header_terabytes", "report results"),
    ("results/gravity_loads.npz", "bytes_2", "report results"),
    ("results/gravity_loads.npz", "along_rigid_empty", "report results"),
    ("results/gravity_loads.npz", "along_calibrated_shorter", "report results"),
    *(
        ("measured.uff", label, line)
        for label in (
            "last_end_gone",
            "line_8_field_3_infinite",
            "line_8_field_4_huge",
            "line_8_field_1_minus",
        )
        for line in (f"{IMPORT} measured.uff", f"{RESPONSE} measured.uff")
    ),
    ("log.csv", "line_1_column_4_huge", f"{RESPONSE} log.csv"),
    ("log.csv", "line_1_column_5_minus_huge", f"{RESPONSE} log.csv"),
    ("log.csv", "line_1_column_6_digits", f"{RESPONSE} log.csv"),
    ("others.csv", "one_row", _MAP),
    ("poses.csv", "two_rows", "design poses robot.yaml --from poses.csv --count 5 --out new.yaml"),
    ("robot.yaml", "prior_mass_tiny", CALIBRATE),
    ("log.csv", "line_1_column_4_underscore", f"{RESPONSE} log.csv"),
    ("results/.flexcal", "a_program", "calibrate robot.yaml poses.csv --terms kinematic --out results"),
)


def regressions(seeds: Path) -> Iterator[Case]:
    """The cases whose file is among the `seeds`; raises `LookupError` for one that is not generated any more."""
    for file, label, line in REGRESSIONS:
        if not (seeds / file).is_file():
            continue
        subject = next(subject for subject in SUBJECTS if subject.file == file)
        contents = broken_contents(subject, (seeds / file).read_bytes())
        broken = next((broken for name, broken in contents if name == label), None)
        if broken is None:
            raise LookupError(f"{file}-{label} is not generated any more")
        yield Case(f"{file}-{label}", file, broken, tuple(line.split()))
