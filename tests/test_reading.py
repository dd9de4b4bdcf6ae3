"""Files are opened to be read in one place, which refuses what is no regular file and what is larger than its reader can take."""

from __future__ import annotations

import ast
import os
import resource
import socket
from collections.abc import Callable, Iterator
from pathlib import Path
from time import process_time
from zipfile import ZipFile

import numpy as np
import pytest
from refusals import refused

from flexcal.data.tables import open_table
from flexcal.files.formats import ArrayForm, NpzFile, read_json, read_yaml_file
from flexcal.files.transaction import open_regular, read_bytes, read_text, regular_path
from flexcal.importing.readers import read_foreign
from flexcal.model.urdf import pinocchio_shapes, read_elements

LIBRARIES = {
    "AnyReader", "ElementTree.parse", "ET.parse", "ZipFile", "cv2.imread", "fastexcel.read_excel", "from_xml_path", "h5py.File",
    "loadmat", "np.fromfile", "np.genfromtxt", "np.load", "np.loadtxt", "np.memmap", "pyuff.UFF", "sqlite3.connect", "trimesh.load",
    *(f"{polars}.{how}_{kind}" for polars in ("pl", "polars") for how in ("read", "scan")
      for kind in ("csv", "excel", "ipc", "json", "ndjson", "parquet", "parquet_schema")),
}  # fmt: skip
"""Functions of libraries that open what they are given as a path."""
LAST = {name.rpartition(".")[2] for name in LIBRARIES} | {"open", "fdopen", "read_bytes", "read_text"}
CHECKED = {"open_regular", "regular_path", "read_bytes", "read_text", "BytesIO", "StringIO"}
"""What gives a library a path that is checked, a file that is open, or its content."""
ELSEWHERE = {
    "files/transaction": "the one place, and its own files",
    "cli/terminal/standard_streams.py": "the null device in the place of a closed stream",
    "data/tables/streaming.py": "parts in a folder that was just made",
    "studio/steps/verify/verify_step.py": "opens a part of the window",
}
"""Files and folders that open otherwise, and why."""


def openings(tree: ast.Module) -> Iterator[ast.Call]:
    """Calls that open a file to be read by its path, but for flexcal's own data."""
    checked, packaged = set(), set()
    for node in ast.walk(tree):
        if isinstance(node, ast.With):
            pairs = [(item.optional_vars, item.context_expr) for item in node.items]
        else:
            pairs = [(node.targets[0], node.value)] if isinstance(node, ast.Assign) else []
        for name, value in pairs:
            if isinstance(name, ast.Name):
                checked |= {name.id} if called(value) & CHECKED else set()
                packaged |= {name.id} if "files" in called(value) else set()
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name | ast.Attribute):
            continue
        last = node.func.id if isinstance(node.func, ast.Name) else node.func.attr
        if last not in LAST or "__file__" in ast.unparse(node):
            continue
        text, names = ast.unparse(node.func), {n.id for n in ast.walk(node) if isinstance(n, ast.Name)}
        if {".".join(text.split(".")[-2:]), last} & LIBRARIES:
            if not (called(node) & CHECKED or names & checked):
                yield node
        elif reads(node, text) and not (names & packaged or "files" in called(node)):
            yield node


def reads(call: ast.Call, function: str) -> bool:
    """Whether a call opens a file to be read, of Python itself or of a `Path`."""
    if function == "os.open":
        return not {"os.O_CREAT", "os.O_WRONLY", "os.O_DIRECTORY"} & set(
            ast.unparse(call).replace(",", " ").split()
        )
    if function.endswith((".read_text", ".read_bytes")):
        return True
    modes = [a.value for a in call.args if isinstance(a, ast.Constant) and isinstance(a.value, str)]
    method = function.endswith(".open") and len(modes) == len(call.args)
    return (function in ("open", "io.open", "os.fdopen") or method) and not set("wax") & set(
        "".join(modes[-1:])
    )


def called(tree: ast.AST) -> set[str]:
    """Names of the functions that are called in an expression."""
    functions = [node.func for node in ast.walk(tree) if isinstance(node, ast.Call)]
    named = [function.id for function in functions if isinstance(function, ast.Name)]
    return {*named, *(function.attr for function in functions if isinstance(function, ast.Attribute))}


def test_files_are_opened_in_one_place(root: Path) -> None:
    """If this fails, use `open_regular`, `read_bytes`, `read_text` or `regular_path` of `flexcal.files.transaction`."""
    source, found = root / "src" / "flexcal", []
    for file in sorted(source.rglob("*.py")):
        name = file.relative_to(source).as_posix()
        if not any(name == place or name.startswith(f"{place}/") for place in ELSEWHERE):
            calls = openings(ast.parse(file.read_text(encoding="utf-8")))
            found += [f"{name}:{call.lineno}: {ast.unparse(call)[:80]}" for call in calls]
    assert found == []


@pytest.mark.parametrize(
    "line",
    ["open(path)", "path.open('rb')", "path.read_text()", "os.open(p, os.O_RDONLY)", "np.load(p)", "h5py.File(p, 'r')", "ET.parse(p)"],
)  # fmt: skip
def test_other_openings_are_found(line: str) -> None:
    assert list(openings(ast.parse(line)))


@pytest.mark.parametrize(
    "line",
    [
        "open(path, 'w')",
        "path.open('wb')",
        "read_text(path)",
        "np.load(regular_path(p, limit=1))",
        "json.loads(text)",
    ],
)
def test_what_opens_nothing_by_itself_is_not_found(line: str) -> None:
    assert not list(openings(ast.parse(line)))


@pytest.mark.parametrize(
    "reader", [lambda p: open_regular(p, limit=9), lambda p: regular_path(p, limit=9), read_bytes, read_text]
)
def test_what_is_no_regular_file_is_refused_at_once(tmp_path: Path, reader: Callable[[Path], object]) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to("/dev/zero")
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(str(tmp_path / "socket"))
        for name in ("pipe", "link", "socket"):
            with refused("E-FILE-014", name):
                reader(tmp_path / name)


def test_a_folder_and_a_missing_file_are_what_the_system_says(tmp_path: Path) -> None:
    for reader in (lambda p: open_regular(p, limit=None), read_bytes):
        with pytest.raises(IsADirectoryError):
            reader(tmp_path)
        with pytest.raises(FileNotFoundError):
            reader(tmp_path / "none")


def test_text_has_one_kind_of_newline(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"a\r\nb\rc\n")
    assert read_text(tmp_path / "a") == "a\nb\nc\n"


def sparse(path: Path) -> Path:
    """File of 10 GB that takes no place on the disk."""
    with path.open("wb") as stream:
        stream.truncate(10**10)
    return path


def header_and_nothing(path: Path) -> Path:
    with sparse(path).open("r+b") as stream:
        stream.write(b"t,q1\n0,1\n")
    return path


def chain(path: Path) -> Path:
    links = "".join(
        f'<link name="l{i}"/><joint name="j{i}" type="fixed"><parent link="l{i}"/><child link="l{i + 1}"/></joint>'
        for i in range(2000)
    )
    path.write_text(f'<robot name="r">{links}<link name="l2000"/></robot>')
    return path


def keys(path: Path) -> Path:
    path.write_text("\n".join(f"k{i}: 1" for i in range(100_001)))
    return path


def wide(path: Path) -> Path:
    path.write_text(",".join(f"c{i}" for i in range(10_000)) + "\n" + ",".join(["1"] * 10_000) + "\n")
    return path


def text_of(path: Path, text: str) -> Path:
    path.write_text(text)
    return path


def zeros(path: Path) -> Path:
    import polars as pl

    pl.DataFrame({f"q{i}": pl.zeros(3 * 10**6, eager=True) for i in range(25)}).write_parquet(
        path, row_group_size=3 * 10**6
    )
    return path


def one_list(path: Path) -> Path:
    import polars as pl

    pl.DataFrame({"q": [pl.zeros(5 * 10**7, eager=True)]}).write_parquet(path)
    return path


def alike_texts(path: Path) -> Path:
    import polars as pl

    pl.DataFrame({"point": ["x" * 10**6] * 100}).write_parquet(path)
    return path


def two_corners(path: Path) -> Path:
    with ZipFile(path, "w") as book:
        cells = '<row r="1"><c r="A1"/></row><row r="1048576"><c r="XFD1048576"/></row>'
        book.writestr("xl/worksheets/sheet1.xml", f"<worksheet><sheetData>{cells}</sheetData></worksheet>")
    return path


def declared_large(path: Path) -> Path:
    """Archive of one array of 800 MB, of which only the header and some bytes are there."""
    described = "{'descr': '<f8', 'fortran_order': False, 'shape': (100000000,), }".ljust(117) + "\n"
    header = b"\x93NUMPY\x01\x00" + len(described).to_bytes(2, "little") + described.encode()
    with ZipFile(path, "w") as archive:
        archive.writestr("x.npy", header)
    stored, declared = ((128).to_bytes(4, "little"), (8 * 10**8 + 128).to_bytes(4, "little"))
    path.write_bytes(
        path.read_bytes().replace(stored + stored, stored + declared)
    )  # in the archive, and unpacked
    return path


REFUSALS = [
    ("robot.urdf", sparse, read_elements, "E-FILE-020"),
    ("robot.urdf", chain, read_elements, "E-URDF-046"),
    ("robot.yaml", sparse, read_yaml_file, "E-FILE-020"),
    ("robot.yaml", keys, read_yaml_file, "E-YAML-039"),
    ("a.json", sparse, lambda p: read_json(p, "write it again"), "E-FILE-020"),
    ("a.json", lambda p: text_of(p, "[" * 10**6), lambda p: read_json(p, "write it again"), "E-FILE-025"),
    ("a.json", lambda p: text_of(p, "[" * 60 + "]" * 60), lambda p: read_json(p, "write it again"), "E-FILE-025"),
    ("a.json", lambda p: text_of(p, f"[{'[],' * 1_600_000}0]"), lambda p: read_json(p, "write it again"), "E-FILE-022"),
    ("a.json", lambda p: text_of(p, "9" * 5000), lambda p: read_json(p, "write it again"), "E-FILE-024"),
    ("a.json", lambda p: text_of(p, "[NaN]"), lambda p: read_json(p, "write it again"), "E-FILE-024"),
    ("a.csv", sparse, open_table, "E-TABLE-048"),
    ("a.csv", header_and_nothing, lambda p: open_table(p).read(), "E-TABLE-048"),
    ("a.csv", header_and_nothing, lambda p: list(open_table(p).blocks()), "E-TABLE-048"),
    ("a.csv", wide, open_table, "E-TABLE-050"),
    ("a.parquet", zeros, lambda p: open_table(p).read(), "E-TABLE-047"),
    ("a.parquet", zeros, lambda p: list(open_table(p).blocks()), "E-TABLE-047"),
    ("a.parquet", alike_texts, lambda p: open_table(p).texts("point"), "E-TABLE-049"),
    ("a.parquet", one_list, lambda p: read_foreign(p, []), "E-TABLE-047"),
    ("a.npz", sparse, lambda p: NpzFile(p, "write it again"), "E-FILE-020"),
    ("a.npz", declared_large, lambda p: NpzFile(p, "").read({"x": ArrayForm("real", ("n",))}), "E-FILE-026"),
    ("a.txt", sparse, lambda p: read_foreign(p, []), "E-FILE-020"),
    ("a.txt", wide, lambda p: read_foreign(p, []), "E-IMPORT-075"),
    ("a.xlsx", sparse, lambda p: read_foreign(p, []), "E-FILE-020"),
    ("a.xlsx", two_corners, lambda p: read_foreign(p, []), "E-IMPORT-073"),
    ("a.bag", sparse, lambda p: read_foreign(p, []), "E-IMPORT-036"),
    ("a.mat", sparse, lambda p: read_foreign(p, []), "E-FILE-020"),
    ("a.uff", sparse, lambda p: read_foreign(p, []), "E-FILE-020"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "make", "reader", "code"), REFUSALS)
def test_what_is_too_large_is_refused_before_it_is_loaded(
    tmp_path: Path, name: str, make: Callable[[Path], Path], reader: Callable[[Path], object], code: str
) -> None:
    """Within 2 s of this process and 150 MB."""
    path = make(tmp_path / name)
    start, before = process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with refused(code, name):
        reader(path)
    assert process_time() - start < 2
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 150_000  # KB


def test_a_late_fault_of_a_large_table_is_placed(tmp_path: Path) -> None:
    """A part of it is read cell by cell, not the whole."""
    path = tmp_path / "a.csv"
    path.write_text("t,q1\n" + "0.001,0.25\n" * 100_000 + "0.001,nan\n" + "0.001,0.25\n" * 100_000)
    with refused("E-TABLE-036", "line 100002, column q1"):
        open_table(path).read()
    path.write_text("t,q1\n" + "0.001,0.25\n" * 200_000)
    table = open_table(path).read()
    assert len(table) == 200_000 and table.columns["q1"].sum() == 50_000


def test_a_mat_file_takes_nothing_from_other_files(tmp_path: Path) -> None:
    import h5py

    (tmp_path / "secret").write_bytes(bytes(range(100)))
    with h5py.File(tmp_path / "other.h5", "w") as other:
        other["x"] = np.ones((1, 10))
    with h5py.File(tmp_path / "a.mat", "w", userblock_size=512) as file:
        for name, outside in (("own", None), ("outside", [(str(tmp_path / "secret"), 0, 80)])):
            data = file.create_dataset(name, shape=(1, 10), dtype="f8", external=outside)
            data.attrs["MATLAB_class"] = np.bytes_("double")
        file["link"] = h5py.ExternalLink(str(tmp_path / "other.h5"), "/x")
    with (tmp_path / "a.mat").open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")
    table = read_foreign(tmp_path / "a.mat", [])
    assert list(table.table.columns) == ["own"]


@pytest.mark.parametrize("pipe", ["arm.obj", "paint.mtl", "arm.mtl"])
def test_meshes_of_a_urdf_are_regular_files(tmp_path: Path, pipe: str) -> None:
    """So are the files that they name, and those that Assimp looks for beside them."""
    import pinocchio as pin

    (tmp_path / "arm.obj").write_text("mtllib paint.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    (tmp_path / pipe).unlink(missing_ok=True)
    os.mkfifo(tmp_path / pipe)
    mesh = f'<visual><geometry><mesh filename="package://{tmp_path.name}/arm.obj"/></geometry></visual>'
    urdf = text_of(tmp_path / "r.urdf", f'<robot name="r"><link name="a">{mesh}</link></robot>')
    with refused("E-FILE-014", pipe):
        pinocchio_shapes(pin.buildModelFromXML(urdf.read_text()), urdf, pin.GeometryType.VISUAL)
