"""Names that are HTML, terminal sequences, markup or no UTF-8: they stand in pages, tables and files, and nothing acts on them."""

from __future__ import annotations

import os
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from xml.sax.saxutils import quoteattr

import pytest
from fuzz_room import fault_of
from fuzz_seeds import write_files
from fuzz_worker import Worker

NAMES = {
    "axis_1": "<script>alert(1)</script>",
    "axis_2": '"><img src=x onerror=alert(2)>',
    "axis_3": "[/red][bold]axis :smile: {0} %s",
    "upper": "</script><script>alert(3)</script>",
    "ball": "<b onmouseover=alert(4)>ball</b>",
    "tracker": "javascript:alert(5)'\"<svg onload=alert(6)>",
}
CALIBRATE = "calibrate robot.yaml poses.csv --terms kinematic --out results"
LINES = (
    CALIBRATE,
    "verify robot.yaml others.csv --out verification",
    "report results --customer",
    "export urdf robot.yaml --out new.urdf",
    "compensate robot.yaml targets.csv --out commands.csv",
    "predict robot.yaml commands.csv --out tool.csv",
    "export mjcf robot.yaml --out new.xml",
    "export sdf robot.yaml --out new.sdf",
    "export dh robot.yaml --out dh.csv",
    "export json robot.yaml --out new.json",
    "map robot.yaml --count 20 --out map.html",
    "design poses robot.yaml --count 6 --candidates 30 --out chosen.yaml",
    "repeatability robot.yaml visits.csv --out repeatability",
    "certificate robot.yaml --targets targets.csv --before visits.csv --after after.csv --out certificate.html",
    "identify dynamics robot.yaml log.csv --out dynamics",
    "init arm.urdf --out created",
    "import robot.yaml poses.csv --out imported.csv",
)


class Elements(HTMLParser):
    """Elements that a page must not have because of a name."""

    def __init__(self) -> None:
        super().__init__()
        self.scripts = 0
        self.odd: list[str] = []
        self.inside = False

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.scripts += tag == "script"
        self.inside = tag == "script" and not any(name == "type" for name, _ in attrs)
        acting = [name for name, value in attrs if name.startswith("on") or "javascript:" in (value or "")]
        if tag == "img" or acting:
            self.odd.append(f"<{tag} {attrs}>")

    def handle_data(self, data: str) -> None:
        if self.inside and "alert(" in data:
            self.odd.append(data[:100])


@pytest.fixture(scope="module")
def flexcal() -> Iterator[Worker]:
    with Worker() as processes:
        yield processes


def renamed(folder: Path) -> None:
    """The arm's files with `NAMES`."""
    write_files(folder)
    urdf, robot = (folder / "arm.urdf").read_text(), (folder / "robot.yaml").read_text()
    for plain, odd in NAMES.items():
        urdf = urdf.replace(f'"{plain}"', quoteattr(odd))
        robot = robot.replace(f"joint: {plain}", f"joint: '{odd.replace(chr(39), chr(39) * 2)}'")
        robot = robot.replace(f"  {plain}:", f"  '{odd.replace(chr(39), chr(39) * 2)}':")
    (folder / "arm.urdf").write_text(urdf)
    (folder / "robot.yaml").write_text(robot)


def check_pages(folder: Path) -> int:
    """The pages below a folder, checked; their number."""
    pages = [path for path in folder.rglob("*.html") if path.is_file()]
    for path in pages:
        found = Elements()
        found.feed(path.read_text(encoding="utf-8"))
        assert not found.odd, f"{path.name}: {found.odd[:3]}"
    return len(pages)


def test_odd_names_in_a_calibration(flexcal: Worker, tmp_path: Path) -> None:
    renamed(tmp_path / "arm")
    ending = flexcal.run(CALIBRATE.split(), tmp_path / "arm")
    assert ending.status == 0 and fault_of(ending, None) is None, ending
    assert NAMES["axis_3"] in " ".join(
        (ending.out + (tmp_path / "arm/results/estimates.yaml").read_text()).split()
    )
    assert check_pages(tmp_path / "arm") == 1


@pytest.mark.slow
def test_odd_names_in_every_verb(flexcal: Worker, tmp_path: Path) -> None:
    renamed(tmp_path / "arm")
    for line in LINES:
        ending = flexcal.run(line.split(), tmp_path / "arm")
        assert ending.status == 0 and fault_of(ending, None) is None, (line, ending)
    assert check_pages(tmp_path / "arm") >= 8


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [b"k\xe4se", b"\xff\xfe", b"[red]\x1b[31m", b"a'\"b <script>", "ζ ☃".encode(), b"{0} %s $HOME"]
)
def test_odd_file_names(name: bytes, flexcal: Worker, tmp_path: Path) -> None:
    """Folders and files of any name that the system allows: verbs read and write there, or say so in one sentence."""
    odd = os.fsdecode(name)
    folder = tmp_path / odd
    write_files(folder)
    for file in ("poses.csv", "log.csv"):
        (folder / file).rename(folder / f"{odd} {file}")
    (folder / "robot.yaml").rename(folder / f"{odd}.yaml")
    words = f"{odd}.yaml"
    for line in (
        ["calibrate", words, f"{odd} poses.csv", "--terms", "kinematic", "--out", f"{odd} results"],
        ["report", f"{odd} results"],
        ["verify", words, "others.csv", "--estimates", f"{odd} results"],
        ["export", "urdf", words, "--estimates", f"{odd} results", "--out", f"{odd}.urdf"],
        ["identify", "dynamics", words, f"{odd} log.csv", "--out", f"{odd} dynamics"],
        ["import", words, f"{odd} poses.csv", "--out", f"{odd} imported.csv"],
        ["init", "arm.urdf", "--out", f"{odd} created"],
        ["design", "poses", words, "--count", "6", "--candidates", "30", "--out", f"{odd} plan.yaml"],
        ["map", words, "--estimates", f"{odd} results", "--count", "20", "--out", f"{odd}.html"],
        ["calibrate", f"{odd} none.yaml", f"{odd} poses.csv"],
    ):
        ending = flexcal.run(line, folder)
        fault = fault_of(ending, [".yaml", ".csv", ".html", ".urdf", "results"])
        assert fault is None, (line, fault)
    assert check_pages(folder) >= 1
