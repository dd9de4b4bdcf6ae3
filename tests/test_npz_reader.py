"""Arrays of .npz files: one sentence for whatever is not of the expected kind, shape or size."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import numpy as np
import pytest

from flexcal.errors import InputError
from flexcal.files.formats import ArrayForm, NpzFile

FORMS = {
    "q": ArrayForm("real", ("rows", 3)),
    "names": ArrayForm("text", ("rows",)),
    "payload": ArrayForm("real", finite=False),
}
RIGHT = {"q": np.ones((2, 3)), "names": np.array(["a", "b"]), "payload": np.array(np.nan)}


def fault(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        NpzFile(path, "run it again").read(FORMS)
    assert str(caught.value).startswith(f"{path} ") and str(caught.value).endswith("; run it again.")
    return str(caught.value)


def test_what_fits_is_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", **RIGHT)
    file = NpzFile(tmp_path / "a.npz", "run it again")
    found = file.read(FORMS)
    assert list(found) == list(FORMS) and "q" in file and "other" not in file
    np.testing.assert_array_equal(found["q"], RIGHT["q"])


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"q": np.ones((2, 4))}, "shape (2, 4)"),
        ({"q": np.array(1.0)}, "shape ()"),
        ({"names": np.array(["a"])}, "'names' with the shape (1,)"),
        ({"names": np.ones(2)}, "not texts"),
        ({"q": np.full((2, 3), "1")}, "not numbers"),
        ({"q": np.ones((2, 3), complex)}, "complex128"),
        ({"q": np.full((2, 3), np.nan)}, "not finite"),
        ({"q": np.full((2, 3), None)}, "no array of numbers or texts"),
        ({"payload": np.array("2026-01-01", "datetime64[D]")}, "datetime64"),
    ],
)
def test_other_arrays(tmp_path: Path, changed: dict[str, np.ndarray], words: str) -> None:
    np.savez(tmp_path / "a.npz", allow_pickle=True, **(RIGHT | changed))
    assert words in fault(tmp_path / "a.npz")


def archive(path: Path, content: bytes) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as zipped:
        zipped.writestr("q.npy", content)
    return path


def test_other_files(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    assert "No such file" in fault(path)
    for content in (b"", b"nothing", b"PK\x03\x04" + bytes(100), b"\x93NUMPY\x01\x00"):
        path.write_bytes(content)
        assert "cannot be read" in fault(path)
    stream = io.BytesIO()
    np.save(stream, np.ones(3))
    path.write_bytes(stream.getvalue())
    assert "is no .npz file" in fault(path)
    np.savez(path, q=np.ones((2, 3)))
    assert "lacks the array 'names'" in fault(path)


def test_no_more_memory_is_taken_than_the_file_has(tmp_path: Path) -> None:
    described = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000, 1000000), }".ljust(117) + "\n"
    header = b"\x93NUMPY\x01\x00" + len(described).to_bytes(2, "little") + described.encode()
    assert "no array of numbers" in fault(archive(tmp_path / "a.npz", header + bytes(80)))
