"""The report of measured frequency responses says what they say, and what to do where they are not known well."""

from __future__ import annotations

from base64 import b64decode
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from outline import Outline

from flexcal.frequency.periodic import FrequencyResponse
from flexcal.jobs.pages import report_folder
from flexcal.jobs.response.planned import IdentifiedResponses
from flexcal.jobs.result_files import RunRecord, read_results, write_results
from flexcal.jobs.two_stage import TwoStageRun
from flexcal.report.checks import limit_of, response_checks
from flexcal.report.pages import ResponseStudy
from flexcal.report.pages.frequency_response import response_page

AXES = ("joint_1", "joint_2")


def measured(noise: Sequence[float], total: Sequence[float], pose: int = 0) -> FrequencyResponse:
    """Seven lines of two axes whose diagonal elements have these standard deviations, relative to them; symmetric but for 1 %."""
    rng = np.random.default_rng(pose)
    response = rng.uniform(0.5, 1.0, (7, 2, 2)) * np.exp(1j * rng.uniform(0, 6, (7, 2, 2)))
    response[:, 1, 0] = response[:, 0, 1]
    response[:, 1, 0] += 0.005 * np.sqrt(2.0) * rng.normal(size=(7, 2)) @ [1.0, 1.0j]

    def covariance(shares: Sequence[float]) -> np.ndarray:
        std = np.abs(response) * np.diag(shares)
        std[:, [0, 1], [1, 0]] = 0.005 * np.sqrt(2.0)
        stacked = np.swapaxes(std, 1, 2).reshape(7, 4)
        return np.einsum("li,ij->lij", stacked**2, np.eye(4)).astype(complex)

    return FrequencyResponse(
        frequencies_hz=np.arange(5.0, 12.0),
        response=response,
        covariance=covariance(total),
        noise_covariance=covariance(noise),
        degrees_of_freedom=45.0,
        realisations=response[None],
        joints=AXES,
        q_mean=np.array([0.1, -0.2, 0.0]),
        payload=2.5,
        pose=pose,
        sample_time=1e-3,
    )


def left(folder: Path, responses: Sequence[FrequencyResponse]) -> ResponseStudy:
    """The folder of these responses, and what it holds."""
    files = tuple(folder / f"response_pose_{response.pose + 1}.npz" for response in responses)
    for response, file in zip(responses, files, strict=True):
        response.save(file)
    origin = {f"input.log_{k}.csv": f"{k:064d}" for k in range(30)}
    found = IdentifiedResponses(
        tuple(responses), files, "arm", RunRecord(origin, "flexcal identify response r f")
    )
    write_results(folder, found.document())
    report_folder(folder)
    return ResponseStudy(read_results(folder), responses)


def test_the_page_shows_every_pose(simulated: TwoStageRun, tmp_path: Path) -> None:
    responses = simulated.stiffness.responses
    study = left(tmp_path, responses)
    before = (tmp_path / "report.html").read_bytes()
    assert report_folder(tmp_path).read_bytes() == before
    outline = Outline(before.decode())
    assert outline.unbalanced == []
    traces = outline.figures()["figure-levels"]["data"]
    assert len(traces) == 27 * len(responses)
    for number, response in enumerate(responses):
        own = [trace for trace in traces if trace["meta"]["pose"] == f"Pose {response.pose + 1}"]
        assert len(own) == 27 and all(trace["visible"] == (number == 0) for trace in own)
        shown = [np.frombuffer(b64decode(own[k]["y"]["bdata"]), own[k]["y"]["dtype"]) for k in (0, 2)]
        np.testing.assert_allclose(shown[0], np.abs(response.response[:, 0, 0]), rtol=1e-5)
        np.testing.assert_allclose(shown[1], response.noise_std[:, 0, 0], rtol=1e-5)
        share = 100 * np.median([response.std[:, i, i] / abs(response.response[:, i, i]) for i in range(3)])
        row = next(row for row in table(study) if row[0] == f"Pose {response.pose + 1}")
        angles = [float(text) for text in row[1].removesuffix("°").replace("−", "-").split(", ")]
        assert row[5] == f"{share:.1f} %"
        np.testing.assert_allclose(angles, np.rad2deg(response.q_mean), atol=0.0501)
    assert "flexcal identify response r f" in outline.words and f"{29:064d}" in outline.words
    assert "The 30 files that it was made from" in outline.words


def table(study: ResponseStudy) -> tuple[Any, ...]:
    block = response_page(study).sections[0].blocks[0]
    assert block.kind == "table"
    return block.rows


def test_what_limits_it_and_what_helps(tmp_path: Path) -> None:
    """By variance: noise of 0.7 is less than half of it, of 0.72 more."""
    for share, limit, cure in ((0.70, "distortion", "more realisations"), (0.72, "noise", "more periods")):
        response = measured([0.2 * share] * 2, [0.2] * 2)
        study = left(tmp_path, [response])
        assert limit_of(study.results["responses"]) == limit
        check = response_checks(study.results, [response])[1]
        assert check.status == "care" and "20.0 %" in check.answer and cure in check.answer
        verdict = response_page(study).verdict
        assert verdict.facts[1].value == limit.capitalize()
        assert verdict.facts[0].value == "20.0 %"
        assert table(study)[0][2] == "2.5 kg"
        distortion = 20 * np.sqrt(1 - share**2)
        assert table(study)[0][5:8] == ("20.0 %", f"{20 * share:.1f} %", f"{distortion:.1f} %")


def statuses(responses: Sequence[FrequencyResponse], folder: Path) -> list[str]:
    study = left(folder, responses)
    checks = response_checks(study.results, responses)
    assert response_page(study).verdict.checks == checks
    return [check.status for check in checks]


def test_the_verdict_turns_with_the_responses(tmp_path: Path) -> None:
    good = [measured([0.01] * 2, [0.05] * 2, pose) for pose in range(3)]
    assert statuses(good, tmp_path) == ["good"] * 5
    assert statuses(good[:1], tmp_path) == ["unknown", "good", "good", "unknown", "good"]
    for share, known in ((0.11, "care"), (0.31, "bad")):
        wide = [measured([0.01] * 2, [share] * 2, pose) for pose in range(3)]
        assert statuses(wide, tmp_path)[1] == known
    lost = [*good[:2], measured([0.01] * 2, [0.01, 0.31], 2)]
    assert statuses(lost, tmp_path)[2] == "care"
    answer = response_checks(left(tmp_path, lost).results, lost)[2].answer
    assert "Not joint_2 in pose 3:" in answer
    odd = [*good[:2], measured([0.01] * 2, [0.09] * 2, 2)]
    assert statuses(odd, tmp_path) == ["good"] * 5
    odd = [measured([0.005] * 2, [0.035] * 2, pose) for pose in range(2)] + odd[2:]
    assert statuses(odd, tmp_path)[3] == "care"
    few = [replace(response, degrees_of_freedom=19.0) for response in good]
    assert statuses(few, tmp_path)[4] == "care"


def test_wrong_torque_gain_is_no_trusted_response(tmp_path: Path) -> None:
    """The responses to the torque of joint_2 are 1.5 times too large, or 2 %."""
    good = [measured([0.01] * 2, [0.05] * 2, pose) for pose in range(3)]
    for gain, trusted, reason in (
        (1.0, True, "reciprocity"),
        (1.02, None, "reciprocity"),
        (1.5, False, "reciprocity"),
    ):
        scaled = [replace(r, response=r.response * [1.0, gain]) for r in good]
        results = left(tmp_path, scaled).results
        assert results["verdict"] == {"trusted": trusted, "reasons": [reason]}
        assert results["reciprocity"][0]["joints"] == list(AXES) and results["reciprocity"][0]["lines"] == 21


def test_odd_distortion_is_shown_where_it_was_measured(tmp_path: Path) -> None:
    response = measured([0.01] * 2, [0.05] * 2)
    assert len(table(left(tmp_path, [response]))[0]) == 9
    seen = replace(response, odd_distortion=np.array([0.012, 0.034]))
    assert table(left(tmp_path, [seen]))[0][9] == "3.4 %"
