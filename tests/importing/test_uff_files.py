"""Universal files that pyuff wrote."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.importing.columns import guess_columns
from flexcal.importing.readers import read_foreign

pyuff = pytest.importorskip("pyuff")


def history(data: np.ndarray, step: float, **more) -> dict:
    """A data set 58 with all that its writer asks for."""
    size = len(data)
    given = {
        "type": 58,
        "binary": 0,
        "func_type": 1,
        "id1": "NONE",
        "rsp_node": 1,
        "rsp_dir": 3,
        "data": data,
    } | more
    zeros = dict.fromkeys(
        (
            *("ver_num", "load_case_id", "rsp_dir", "ref_node", "ref_dir", "abscissa_min", "z_axis_value"),
            *(f"{axis}_{key}_unit_exp" for axis in ("abscissa", "ordinate", "orddenom", "z_axis")
              for key in ("len", "force", "temp")),
            *(f"{axis}_spec_data_type" for axis in ("orddenom", "z_axis")),
        ),
        0,
    )  # fmt: skip
    texts = {
        f"{axis}_axis_{key}": "NONE"
        for axis in ("abscissa", "ordinate", "orddenom", "z_axis")
        for key in ("lab", "units_lab")
    }
    texts |= {f"z_axis_axis_{key}": "NONE" for key in ("lab", "units_lab")}
    lines = dict.fromkeys(("id2", "id3", "id4", "id5", "rsp_ent_name", "ref_ent_name"), "NONE")
    return (
        zeros | texts | lines
        | {"func_num": 1, "ord_data_type": 4, "num_pts": size, "abscissa_spacing": 1, "abscissa_inc": step,
           "abscissa_spec_data_type": 17, "ordinate_spec_data_type": 8, "x": step * np.arange(size)}
        | given
    )  # fmt: skip


def written(path: Path, *sets: dict) -> Path:
    file = pyuff.UFF(str(path))
    for item in sets:
        file.write_sets(item, "add")
    return path


def test_named_histories_are_a_log(tmp_path: Path, ur5, rng: np.random.Generator) -> None:
    q = rng.uniform(-2, 2, (6, 50))
    sets = [history(q[i], 0.004, id1=f"q{i + 1}", ordinate_axis_units_lab="rad") for i in range(6)]
    foreign = read_foreign(written(tmp_path / "a.uff", *sets), ())
    guess = guess_columns(foreign, ur5)
    assert guess.placed["t"].unit == "s" and guess.placed["q"].unit == "rad"
    np.testing.assert_allclose(guess.placed["q"].values(foreign.table), q.T, rtol=1e-5)
    np.testing.assert_allclose(foreign.numbers["t"], 0.004 * np.arange(50), rtol=1e-6)


def test_nodes_directions_and_what_is_left_out(tmp_path: Path, rng: np.random.Generator) -> None:
    data = rng.normal(size=(4, 40))
    sets = [
        history(data[0], 0.01, rsp_node=3, rsp_dir=3),
        history(data[1], 0.01, rsp_node=3, rsp_dir=-1),
        history(data[2], 0.01, rsp_node=4, rsp_dir=5),
        history(data[3], 0.02, rsp_node=9, rsp_dir=1),
        history(data[0] + 1j * data[1], 0.5, func_type=4, ord_data_type=5, rsp_node=9, rsp_dir=2),
    ]
    foreign = read_foreign(written(tmp_path / "a.unv", *sets), ())
    assert list(foreign.numbers) == ["t", "node 3 +Z", "node 3 -X", "node 4 +RY"]
    np.testing.assert_allclose(foreign.numbers["node 3 -X"], data[1], rtol=1e-5)
    assert foreign.notes == (
        "sampled at other times, left out: node 9 +X",
        "data sets that are no time histories, left out: 1",
    )


def test_what_is_none(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, rng: np.random.Generator) -> None:
    response = history(rng.normal(size=9) + 0j, 0.5, func_type=4, ord_data_type=5)
    with refused("E-IMPORT-048"):
        read_foreign(written(tmp_path / "frf.uff", response), ())
    (tmp_path / "text.uff").write_text("nothing of the kind\n")
    with refused("E-IMPORT-048"):
        read_foreign(tmp_path / "text.uff", ())
    monkeypatch.setitem(sys.modules, "pyuff", None)
    with refused("E-IMPORT-046"):
        read_foreign(tmp_path / "frf.uff", ())


def test_a_file_that_was_cut_off(tmp_path: Path, rng: np.random.Generator) -> None:
    """Wherever: a data set without its end, one with fewer values than it announces, and a header without some of its lines."""
    path = written(tmp_path / "whole.uff", *(history(rng.normal(size=40), 0.01, id1=f"q{k}") for k in (1, 2)))
    content = path.read_bytes()
    lines = content.splitlines(keepends=True)
    cut = tmp_path / "cut.uff"
    for length in range(len(content) * 3 // 5, len(content) - 8, 97):
        cut.write_bytes(content[:length])
        with refused("E-IMPORT-049"):
            read_foreign(cut, ())
    assert len(lines) == 2 * (14 + 10)
    cut.write_bytes(b"".join(lines[:20] + lines[23:]))
    with refused("E-IMPORT-051", "1", "40", "28"):
        read_foreign(cut, ())
    cut.write_bytes(b"".join(lines[:27] + lines[29:]))
    with refused("E-IMPORT-050", "2"):
        read_foreign(cut, ())


@pytest.mark.parametrize("between", [b"", b"\n", bytes(40) + b"\r\n"])
def test_binary_histories(tmp_path: Path, rng: np.random.Generator, between: bytes) -> None:
    """Values end where the header says so: some writers fill the last record of their file, and some end no line."""
    data = rng.normal(size=(2, 25))
    path = written(
        tmp_path / "a.uff",
        *(history(item, 0.01, binary=1, id1=f"q{k}") for k, item in enumerate(data)),
    )
    content = path.read_bytes()
    for values in data:
        head, last, tail = content.partition(values.astype("<f8").tobytes())
        assert last and tail.lstrip(b"\n").startswith(b"    -1\n")
        content = head + last + between + tail.lstrip(b"\n")
    path.write_bytes(content)
    foreign = read_foreign(path, ())
    np.testing.assert_array_equal(np.array([foreign.numbers["q0"], foreign.numbers["q1"]]), data)
    path.write_bytes(content[:-20])
    with refused("E-IMPORT-049"):
        read_foreign(path, ())
