"""`design frequency` with poses and amplitudes chosen: plan, page and document, and options that do not go together."""

from __future__ import annotations

import numpy as np
import pytest
from refusals import assert_refusal
from test_bad_input import refused_run

from flexcal.data.plans import MultisinePlan, read_plan_of


def test_a_designed_plan_says_what_it_will_tell(run, tx90l_folder):
    out = tx90l_folder / "plan.yaml"
    options = (
        "--plan",
        "quick",
        "--choose",
        "3",
        "--candidates",
        "6",
        "--amplitude",
        "flat",
        "--detection-lines",
    )
    document = run(
        "design", "frequency", tx90l_folder / "robot.yaml", "--out", out, *options, "--json"
    ).document
    plan = read_plan_of(out, MultisinePlan)
    assert (
        plan.poses.shape == (3, 6)
        and plan.detection_lines.size
        and np.ptp(plan.amplitude, axis=1).max() < 1e-9
    )
    assert document["seconds_on_the_robot"] == pytest.approx(3 * 172.8)
    predicted = document["predicted_std"]
    assert len(predicted) == 18 and predicted == document["predicted_std_flat"]
    largest = document["largest_stiffness_std"]
    assert largest["std"] == max(std for name, std in predicted.items() if name.endswith(".stiffness"))
    assert [row["poses"] for row in document["curve"]] == [1, 2, 3, 4, 5, 6]
    page = out.with_suffix(".html").read_text(encoding="utf-8")
    assert "Number of poses" in page and "Amplitude spectrum" in page


def test_given_poses_have_a_prediction_too(run, tx90l_folder):
    out = tx90l_folder / "plan.yaml"
    document = run(
        "design", "frequency", tx90l_folder / "robot.yaml", "--plan", "paper", "--out", out, "--json"
    ).document
    largest = document["largest_stiffness_std"]
    assert largest["name"] == "joint_3.bearing_y.stiffness"  # no payload twists the forearm
    assert largest["std"] > 0.5 and "curve" not in document
    assert "The stiffness of joint_3 bearing y is not identifiable" in out.with_suffix(".html").read_text(
        encoding="utf-8"
    )


@pytest.mark.parametrize(
    ("options", "refusal"),
    [
        (
            ("--amplitude", "shaped"),
            ["E-DESIGN-001", "3", "0"],
        ),
        (("--choose", "4"), ["E-CLI-021"]),
        (("--std", "-1"), ["E-CLI-020", "-1"]),
        (("--std", "0.0001"), ["E-DESIGN-010", "0.01", "24"]),
        (("--plan", "quick", "--poses", "frequency_poses.csv"), ["E-RUN-042", "quick"]),
    ],
)
def test_options_that_cannot_be_met(run, tx90l_folder, options, refusal: list[str]):
    given = [tx90l_folder / o if o.endswith(".csv") else o for o in options]
    out = tx90l_folder / "plan.yaml"
    arguments = ("design", "frequency", tx90l_folder / "robot.yaml", "--out", out, *given)
    assert_refusal(refused_run(run, tx90l_folder, *arguments), *refusal)
