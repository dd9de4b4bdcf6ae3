"""Response of an axis to any excitation: records in memory give what their files give on the command line."""

from pathlib import Path

import numpy as np
import pytest
from refusals import refused
from scipy.signal import cont2discrete, dlsim

from flexcal import frequency_response
from flexcal.cli.main import main
from flexcal.jobs.result_files import read_results

N, STEP = 6000, 1e-3


@pytest.fixture(scope="module")
def records() -> list[dict[str, np.ndarray]]:
    """Two masses of 0.01 and 0.02 kg m² on a spring of 400 N m/rad, with noise of the velocity."""
    accelerations = [[-4e4, 4e4, -4.0, 4.0], [2e4, -2e4, 2.0, -2.0]]
    a = np.array([[0, 0, 1, 0], [0, 0, 0, 1], *accelerations])
    b, c = np.array([[0], [0], [100.0], [0]]), np.array([[0, 0, 1, 0]])
    system = cont2discrete((a, b, c, np.zeros((1, 1))), STEP)
    rng, made = np.random.default_rng(1), []
    for _ in range(2):
        torque = rng.standard_normal(N)
        velocity = dlsim(system, torque)[1][:, 0] + 0.01 * rng.standard_normal(N)
        made.append({"t": STEP * np.arange(N), "torque[Nm]": torque, "velocity[rad/s]": velocity})
    return made


def test_it_is_that_of_the_command_line(records: list[dict[str, np.ndarray]], tmp_path: Path) -> None:
    files = [tmp_path / f"record_{k}.csv" for k in range(2)]
    for file, record in zip(files, records, strict=True):
        np.savetxt(
            file, np.column_stack(list(record.values())), "%.17g", ",", header=",".join(record), comments=""
        )
    out = tmp_path / "out"
    assert main(["identify", "response", *map(str, files), "--masses", "2", "--out", str(out)]) == 0
    axis = frequency_response(records, masses=2)
    axis.write(tmp_path / "again")
    stored, ours = read_results(out), read_results(tmp_path / "again")
    for key in ("elements", "resonances", "masses", "halves", "feedback", "verdict"):
        assert ours[key] == stored[key], key
    assert ours["excitation"].pop("files") == ["record 1", "record 2"]
    assert stored["excitation"].pop("files") == ["record_0.csv", "record_1.csv"]
    assert ours["excitation"] == stored["excitation"]
    assert (tmp_path / "again" / "response.csv").read_bytes() == (out / "response.csv").read_bytes()
    assert axis.resonances[0].frequency_hz.estimate == pytest.approx(38.98, rel=1e-3)
    assert repr(axis).startswith("<AxisResponse of record 1 and 1 more: ") and "inertia" in axis.summary()
    page = axis.report(tmp_path / "page.html").read_text("utf-8")
    assert page.rstrip().endswith("</html>") and "<pre>" in axis._repr_html_()


def test_columns_of_one_length(records: list[dict[str, np.ndarray]]) -> None:
    with refused("E-IMPORT-056", "record 1"):
        frequency_response([{**records[0], "t": records[0]["t"][1:]}])


def test_a_signal_that_stands_still(records: list[dict[str, np.ndarray]]) -> None:
    for name in ("torque[Nm]", "velocity[rad/s]"):
        with refused("E-IMPORT-077", "record 1", name.partition("[")[0]):
            frequency_response(
                [{**record, name: np.full(N, 3.0)} for record in records],
                inputs=["torque[Nm]"],
                outputs=["velocity[rad/s]"],
            )
