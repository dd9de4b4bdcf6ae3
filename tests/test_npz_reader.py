"""Arrays of .npz files: one sentence for whatever is not of the expected kind, shape or size."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.files.formats import ArrayForm, NpzFile

FORMS = {
    "q": ArrayForm("real", ("rows", 3)),
    "names": ArrayForm("text", ("rows",)),
    "payload": ArrayForm("real", finite=False),
}
RIGHT = {"q": np.ones((2, 3)), "names": np.array(["a", "b"]), "payload": np.array(np.nan)}


def check_refused(path: Path, code: str, *names: str) -> None:
    """Reading is refused with this code, by a sentence with the file, these names and the remedy."""
    with refused(code, *names) as caught:
        NpzFile(path, "run it again").read(FORMS)
    assert str(caught.value).startswith(f"{path} ") and str(caught.value).endswith("; run it again.")


def test_what_fits_is_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", **RIGHT)
    file = NpzFile(tmp_path / "a.npz", "run it again")
    found = file.read(FORMS)
    assert list(found) == list(FORMS) and "q" in file and "other" not in file
    np.testing.assert_array_equal(found["q"], RIGHT["q"])


@pytest.mark.parametrize(
    ("changed", "refusal"),
    [
        ({"q": np.ones((2, 4))}, ["E-FILE-007", "2, 4"]),
        ({"q": np.array(1.0)}, ["E-FILE-007", "q", "()"]),
        ({"names": np.array(["a"])}, ["E-FILE-007", "names", "1"]),
        ({"names": np.ones(2)}, ["E-FILE-006", "texts"]),
        ({"q": np.full((2, 3), "1")}, ["E-FILE-006", "numbers"]),
        ({"q": np.ones((2, 3), complex)}, ["E-FILE-006", "complex128"]),
        ({"q": np.full((2, 3), np.nan)}, ["E-FILE-008"]),
        ({"q": np.full((2, 3), None)}, ["E-FILE-005"]),
        ({"payload": np.array("2026-01-01", "datetime64[D]")}, ["E-FILE-006", "datetime64"]),
    ],
)
def test_other_arrays(tmp_path: Path, changed: dict[str, np.ndarray], refusal: list[str]) -> None:
    np.savez(tmp_path / "a.npz", allow_pickle=True, **(RIGHT | changed))
    check_refused(tmp_path / "a.npz", *refusal)


def archive(path: Path, content: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as zipped:
        zipped.writestr("q.npy", content)
    return path


def test_other_files(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    check_refused(path, "E-FILE-003", "No such file")
    for content in (b"", b"nothing", b"PK\x03\x04" + bytes(100), b"\x93NUMPY\x01\x00"):
        path.write_bytes(content)
        check_refused(path, "E-FILE-003")
    stream = io.BytesIO()
    np.save(stream, np.ones(3))
    path.write_bytes(stream.getvalue())
    check_refused(path, "E-FILE-002")
    np.savez(path, q=np.ones((2, 3)))
    check_refused(path, "E-FILE-004", "names")


def test_no_more_memory_is_taken_than_the_file_has(tmp_path: Path) -> None:
    described = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000, 1000000), }".ljust(117) + "\n"
    header = b"\x93NUMPY\x01\x00" + len(described).to_bytes(2, "little") + described.encode()
    check_refused(archive(tmp_path / "a.npz", header + bytes(80)), "E-FILE-005")
