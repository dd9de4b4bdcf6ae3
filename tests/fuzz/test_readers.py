"""Readers of files on contents that Hypothesis makes up: they return, or raise one `InputError`, and nothing else."""

from __future__ import annotations

import io
import json
from pathlib import Path

import numpy as np
import pytest
from fuzz_foreign import write_recordings
from fuzz_seeds import CELL, PLAN, ROBOT, URDF
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from flexcal.data.plans import read_plan
from flexcal.data.tables import open_table
from flexcal.errors import InputError
from flexcal.files.formats import read_yaml, read_yaml_file
from flexcal.files.formats.estimates_file import StoredEstimates
from flexcal.files.structuring import StructureError, structure
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.importing.readers import read_foreign
from flexcal.jobs.result_files import read_results
from flexcal.model.robot import RobotConfig
from flexcal.model.urdf import read_urdf
from flexcal.virtual_cell import CellConfig

pytestmark = pytest.mark.slow
thorough = settings(
    max_examples=300, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None
)

SCALARS = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.integers(-(2**70), 2**70),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["0o9", "1e999", "1e51", ".inf", "~", "<script>", "\x1b[2J", "[/red]", "joint_1", "deg"]),
)
KEYS = st.one_of(
    st.text(max_size=6),
    st.sampled_from(
        [
            "robot",
            "points",
            "frame",
            "xyz",
            "elastic",
            "drive",
            "stiffness",
            "values",
            "estimate",
            "fit",
            "kind",
        ]
    ),
)
DATA = st.recursive(
    SCALARS,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=12,
)


def spliced(text: str) -> st.SearchStrategy[bytes]:
    """`text` with some parts of it cut out, repeated or replaced by others."""
    content = text.encode()
    place = st.integers(0, len(content))
    part = st.one_of(
        st.binary(max_size=12),
        st.sampled_from(
            [
                b"",
                b"\n",
                b"- ",
                b": ",
                b"{",
                b"[",
                b"*a",
                b"&a ",
                b"'",
                b'"',
                b"1e308",
                b"-1",
                b".nan",
                b"<",
                b"&x;",
            ]
        ),
        st.tuples(place, st.integers(1, 40)).map(lambda cut: content[cut[0] : cut[0] + cut[1]]),
    )
    edits = st.lists(st.tuples(place, st.integers(0, 30), part), min_size=1, max_size=4)

    def edited(changes: list[tuple[int, int, bytes]]) -> bytes:
        changed = content
        for at, length, new in changes:
            changed = changed[:at] + new + changed[at + length :]
        return changed

    return edits.map(edited)


def ends_well(read, *arguments) -> None:
    try:
        read(*arguments)
    except InputError as problem:
        assert str(problem).strip() and len(str(problem).splitlines()) == 1


@thorough
@given(st.sampled_from([RobotConfig, CellConfig, StoredEstimates]), DATA)
def test_any_data(cls: type, data: object) -> None:
    try:
        structure(data, cls)
    except StructureError as problem:
        assert problem.failures


@thorough
@given(
    st.one_of(
        spliced(ROBOT),
        spliced(CELL),
        st.binary(max_size=60),
        DATA.map(lambda data: json.dumps(data).encode()),
    )
)
def test_yaml(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.yaml"
    path.write_bytes(content)
    ends_well(read_yaml_file, path)
    for cls in (RobotConfig, CellConfig, StoredEstimates):
        ends_well(read_yaml, path, cls)


@thorough
@given(spliced(PLAN))
def test_plans(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "plan.yaml"
    path.write_bytes(content)
    ends_well(read_plan, path)


@thorough
@given(spliced(URDF))
def test_urdf(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "arm.urdf"
    path.write_bytes(content)
    ends_well(read_urdf, path, {})


TABLE = "pose,q1,q2,q3,x,y,z,station\n" + "".join(f"{k},0.{k},-1.5,2e-1,0.{k}5,1.25,-3,a\n" for k in range(9))


@thorough
@given(st.one_of(spliced(TABLE), st.binary(max_size=80)), st.sampled_from([(), ("station",)]))
def test_tables(tmp_path: Path, content: bytes, texts: tuple[str, ...]) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(content)
    ends_well(lambda: open_table(path).read(texts))
    ends_well(lambda: list(open_table(path).blocks(texts, 2)))


@thorough
@given(st.one_of(spliced(TABLE), spliced(TABLE.replace(",", ";").replace(".", ",")), st.binary(max_size=80)))
def test_foreign_tables(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(content)
    ends_well(read_foreign, path, ["axis_1", "axis_2", "axis_3"])


@thorough
@given(DATA)
def test_results(tmp_path: Path, data: object) -> None:
    (tmp_path / "results.json").write_text(json.dumps(data))
    ends_well(read_results, tmp_path)


@thorough
@given(st.lists(st.tuples(st.integers(0, 4000), st.integers(0, 255)), max_size=6), st.integers(0, 4000))
def test_npz(tmp_path: Path, changes: list[tuple[int, int]], length: int) -> None:
    stream = io.BytesIO()
    np.savez(stream, covariance=np.zeros((2, 1, 1)), frequencies_hz=np.ones(2))
    content = bytearray(stream.getvalue())
    for at, byte in changes:
        assume(at < len(content))
        content[at] = byte
    path = tmp_path / "response.npz"
    path.write_bytes(bytes(content[:length] if length % 3 else content))
    ends_well(FrequencyResponse.load, path)


LOG = {"t": np.arange(12) / 100, "q": np.ones((12, 3)), "tau": np.zeros((12, 3))}
RECORDINGS = ("measured.uff", "measured_binary.uff", "recorded.bag", "recorded.mcap", "recorded.db3")


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """Recordings of a dozen rows, those whose packages are there."""
    folder = tmp_path_factory.mktemp("recordings")
    write_recordings(folder, LOG)
    return {name: (folder / name).read_bytes() for name in RECORDINGS if (folder / name).is_file()}


@pytest.mark.parametrize("name", RECORDINGS)
@thorough
@given(
    st.lists(st.tuples(st.floats(0, 1), st.integers(0, 30), st.binary(max_size=12)), max_size=4),
    st.floats(0, 1.5),
)
def test_recordings(
    name: str,
    recordings: dict[str, bytes],
    tmp_path: Path,
    edits: list[tuple[float, int, bytes]],
    length: float,
) -> None:
    """Parts of them cut out, repeated or replaced, and their end cut off."""
    content = recordings.get(name, b"")
    assume(content)
    for share, gone, new in edits:
        at = int(share * len(content))
        content = content[:at] + new + content[at + gone :]
    path = tmp_path / name
    path.write_bytes(content[: int(length * len(content))])
    ends_well(read_foreign, path, ["axis_1", "axis_2", "axis_3"])
