"""Estimates on disk: what is read is what was written, other blocks stay, and files that do not fit are refused."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refused

from flexcal.estimation import Dropped, Estimate, Parameter, Parameters
from flexcal.files.formats import (
    block_sha256,
    provenance,
    read_estimates,
    require_place,
    sha256_of,
    write_estimates,
)


def make_estimate(size: int = 4, seed: int = 0, **changes: Any) -> Estimate:
    rng = np.random.default_rng(seed)
    half = rng.normal(0, 0.1, (size, size))
    items = [
        Parameter("joint_1.drive.stiffness", "N m/rad", 143.7e3 / 3, lower=1.0, scale="log", prior_std=0.3)
    ]
    items += [
        Parameter(f"joint_{i}.offset", "rad", float(rng.normal()), prior_std=5e-4, prior_mean=0.0)
        for i in range(1, size)
    ]
    values: dict[str, Any] = {
        "parameters": Parameters(items),
        "covariance": half @ half.T,
        "rank": size - 1,
        "dropped": (Dropped(items[-1].name, ((items[1].name, 1 / 3), (items[0].name, -2e-9))),),
        "identifiable": (*[True] * (size - 1), False),
        "cost": 12.5,
        "chi2": 11.25,
        "degrees_of_freedom": 77,
        "status": "converged",
        "message": "the step is small: 1e-12",
        "iterations": 7,
        "outliers": (3, 8),
        "provenance": {"program": "flexcal 0", "input.a b.csv": "ab12", "option.seed": "1"},
    }
    return Estimate(**(values | changes))


def same(one: Estimate, other: Estimate) -> None:
    assert np.array_equal(one.covariance, other.covariance)
    for name in ("parameters", "rank", "dropped", "identifiable", "cost", "chi2", "degrees_of_freedom"):
        assert getattr(one, name) == getattr(other, name), name
    for name in ("status", "message", "iterations", "outliers", "provenance"):
        assert getattr(one, name) == getattr(other, name), name
    assert one.interval("joint_1.drive.stiffness") == other.interval("joint_1.drive.stiffness")


def test_round_trip(tmp_path: Path) -> None:
    path = tmp_path / "estimates.yaml"
    estimate = make_estimate()
    write_estimates(path, "stiffness", estimate)
    same(read_estimates(path)["stiffness"], estimate)
    assert sorted(os.listdir(tmp_path)) == ["estimates.npz", "estimates.yaml"]
    text = path.read_text()
    assert "joint_1.drive.stiffness: {estimate: 47900.0, unit: N m/rad, std: " in text


def test_a_block_replaces_only_itself(tmp_path: Path) -> None:
    path = tmp_path / "estimates.yaml"
    one, two, three = make_estimate(4, 1), make_estimate(3, 2), make_estimate(5, 3)
    write_estimates(path, "calibration", one)
    write_estimates(path, "stiffness", two)
    write_estimates(path, "calibration", three)
    read = read_estimates(path)
    assert list(read) == ["stiffness", "calibration"]
    same(read["stiffness"], two)
    same(read["calibration"], three)
    assert list(read_estimates(path, without="calibration")) == ["stiffness"]


def test_an_interrupt_leaves_no_half_of_the_pair(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_text", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_estimates(tmp_path / "estimates.yaml", "stiffness", make_estimate())
    assert os.listdir(tmp_path) == []


def test_the_same_estimates_are_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a.yaml", "b.yaml"):
        write_estimates(tmp_path / name, "stiffness", make_estimate())
        write_estimates(tmp_path / name, "calibration", make_estimate(3))
    before = [(tmp_path / name).read_bytes() for name in ("a.yaml", "a.npz")]
    assert before == [(tmp_path / name).read_bytes() for name in ("b.yaml", "b.npz")]
    write_estimates(tmp_path / "a.yaml", "stiffness", make_estimate())
    assert before == [(tmp_path / name).read_bytes() for name in ("a.yaml", "a.npz")]


def test_npz_that_does_not_fit(tmp_path: Path) -> None:
    path = tmp_path / "estimates.yaml"
    write_estimates(path, "stiffness", make_estimate())
    with np.load(tmp_path / "estimates.npz") as stored:
        names, covariance = stored["stiffness.names"], stored["stiffness.covariance"]

    def check(code: str, *names: str, **arrays: Any) -> None:
        np.savez(tmp_path / "estimates.npz", **arrays)
        with refused(code, *names):
            read_estimates(path)

    label, matrix = "stiffness.names", "stiffness.covariance"
    check("E-EST-009", "estimates.npz", "stiffness", **{label: names})
    check("E-FILE-007", "stiffness.covariance", "(3, 3)", **{label: names, matrix: covariance[:3, :3]})
    check("E-EST-011", **{label: names[::-1], matrix: covariance})
    check("E-EST-012", "estimates.yaml", **{label: names, matrix: 2 * covariance})
    (tmp_path / "estimates.npz").write_bytes(b"nothing")
    with refused("E-FILE-003", "estimates.npz"):
        read_estimates(path)
    (tmp_path / "estimates.npz").unlink()
    with refused("E-FILE-003", "No such file"):
        read_estimates(path)
    write_estimates(path, "stiffness", make_estimate(3))
    assert read_estimates(path)["stiffness"].rank == 2


def test_a_damaged_other_block_is_not_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "estimates.yaml"
    write_estimates(path, "stiffness", make_estimate())
    (tmp_path / "estimates.npz").unlink()
    before = path.read_bytes()
    with refused("E-FILE-003", "the identification again"):
        write_estimates(path, "calibration", make_estimate())
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["estimates.yaml"]


@pytest.mark.parametrize(
    ("old", "new", "refusal"),
    [
        ("stiffness:\n", "stifness:\n", ["E-YAML-001", "line 1", "stifness", "stiffness"]),
        ("rank: 3", "rnk: 3", ["E-YAML-001", "rnk", "in stiffness.fit", "rank"]),
        ("rank: 3", "rank: -3", ["E-EST-003"]),
        ("std: ", "std: -", ["E-EST-001"]),
        ("rank: 3", "rank: three", ["E-YAML-028", "stiffness.fit.rank"]),
        ("scale: log", "scale: cubic", ["E-YAML-032", "scale", "linear', 'log"]),
        ("estimate: 47900.0", "estimate: .nan", ["E-YAML-026", "joint_1.drive.stiffness.estimate"]),
        ("estimate: 47900.0", "estimate: -1", ["E-FIT-013"]),
        ("name: joint_3.offset", "name: joint_9.offset", ["E-EST-013", "joint_9.offset"]),
    ],
)
def test_yaml_that_does_not_fit(tmp_path: Path, old: str, new: str, refusal: list[str]) -> None:
    path = tmp_path / "estimates.yaml"
    write_estimates(path, "stiffness", make_estimate())
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    with refused(*refusal) as caught:
        read_estimates(path)
    assert str(caught.value).startswith(f"{path} line ")


@pytest.mark.parametrize(
    ("estimate", "refusal"),
    [
        (make_estimate(cost=float("nan")), ["E-YAML-017", "stiffness.fit.cost"]),
        (make_estimate(covariance=np.full((4, 4), np.inf)), ["E-EST-005"]),
        (make_estimate(covariance=np.zeros((3, 3))), ["E-EST-005"]),
    ],
)
def test_what_is_not_written(tmp_path: Path, estimate: Estimate, refusal: list[str]) -> None:
    with refused(*refusal):
        write_estimates(tmp_path / "estimates.yaml", "stiffness", estimate)
    assert os.listdir(tmp_path) == []


def test_names_of_files_and_blocks(tmp_path: Path) -> None:
    with refused("E-EST-007"):
        write_estimates(tmp_path / "estimates.txt", "stiffness", make_estimate())
    with refused("E-EST-004", "geometry"):
        write_estimates(tmp_path / "estimates.yaml", "geometry", make_estimate())  # type: ignore[arg-type]


@pytest.mark.parametrize("content", ["arrays", "one array", "text", "nothing"])
def test_an_npz_of_another_program_stays(tmp_path: Path, content: str) -> None:
    path = tmp_path / "estimates.npz"
    if content == "arrays":
        np.savez(path, weights=np.ones(3))
    elif content == "one array":
        with path.open("wb") as stream:
            np.save(stream, np.ones(3))
    else:
        path.write_text("mine" if content == "text" else "")
    before = path.read_bytes()
    with refused("E-FILE-010", "estimates.npz"):
        write_estimates(tmp_path / "estimates.yaml", "calibration", make_estimate())
    with refused("E-FILE-010", "estimates.npz"):
        require_place(tmp_path / "estimates.yaml", "calibration")
    assert path.read_bytes() == before and [p.name for p in tmp_path.iterdir()] == ["estimates.npz"]


def test_a_place_is_refused_for_what_writing_refuses(tmp_path: Path) -> None:
    """A place that takes the block, and others that do not: an end of a name, a link, and another block that cannot be read."""
    path = tmp_path / "estimates.yaml"
    require_place(path, "stiffness")
    write_estimates(path, "stiffness", make_estimate())
    require_place(path, "calibration")
    with refused("E-EST-007"):
        require_place(tmp_path / "estimates.txt", "stiffness")
    (tmp_path / "link.yaml").symlink_to(path)
    with refused("E-FILE-013", "a link"):
        require_place(tmp_path / "link.yaml", "calibration")
    (tmp_path / "estimates.npz").unlink()
    require_place(path, "stiffness")
    with refused("E-FILE-003", "estimates.npz"):
        require_place(path, "calibration")


def test_values_only_are_no_estimate(tmp_path: Path) -> None:
    path = tmp_path / "truth.yaml"
    path.write_text("dynamics: {values: {link_1.mass: {estimate: 12.3, unit: kg}}}\n")
    with refused("E-EST-008", "dynamics"):
        read_estimates(path)


def test_provenance(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"abc")
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "1.csv").write_bytes(b"1")
    write_estimates(tmp_path / "estimates.yaml", "stiffness", make_estimate())
    found = provenance([tmp_path / "a.csv"], {"seed": 3}, tmp_path / "estimates.yaml", ["stiffness"])
    assert found["input.a.csv"].startswith("ba7816bf8f01cfea")  # FIPS 180-2, example B.1
    assert found["option.seed"] == "3"
    assert found["program"].startswith("flexcal ")
    assert found["block.stiffness"] == block_sha256(tmp_path / "estimates.yaml", "stiffness")
    folder = sha256_of(tmp_path / "logs")
    (tmp_path / "logs" / "2.csv").write_bytes(b"2")
    assert sha256_of(tmp_path / "logs") != folder
    with refused("E-FILE-001"):
        sha256_of(tmp_path / "none")
    with refused("E-EST-006", "dynamics"):
        block_sha256(tmp_path / "estimates.yaml", "dynamics")


def test_block_sha256_follows_the_values_only(tmp_path: Path) -> None:
    path = tmp_path / "estimates.yaml"
    write_estimates(path, "stiffness", make_estimate())
    first = block_sha256(path, "stiffness")
    write_estimates(path, "stiffness", make_estimate(provenance={}))
    assert block_sha256(path, "stiffness") == first
    write_estimates(path, "stiffness", make_estimate(seed=1))
    assert block_sha256(path, "stiffness") != first
