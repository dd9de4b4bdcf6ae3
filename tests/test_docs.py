"""What the documentation says is what the program does."""

from __future__ import annotations

import ast
import html
import importlib
import json
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

import flexcal
from flexcal.cli.main import main
from flexcal.dynamics.drives.gains import gain_name
from flexcal.elasticity.response_model import stiffness_parameters
from flexcal.export import Actuators, actuator_name
from flexcal.frequency.periodic import FrequencyResponse
from flexcal.frequency.periodic.response import POOLED_LINES, SMALLEST_FREEDOM
from flexcal.model.parts import LOOP
from flexcal.model.robot import RATIO, ArmSensor, RobotModel, Stations, unit_of
from flexcal.model.robot.measuring_config import ArmSensorConfig

NUMBERS = {"nine": 9, "twelve": 12, "thirteen": 13, "fourteen": 14, "fifteen": 15}


@pytest.fixture(scope="module")
def methods(root: Path) -> str:
    pages = sorted((root / "docs" / "methods").glob("*.md"))
    return "\n".join(page.read_text(encoding="utf-8") for page in pages)


def documented(root: Path) -> dict[str, str]:
    """Unit of every name in the table of docs/file-formats.md, and in that of friction terms, as a pattern."""
    text = (root / "docs" / "file-formats.md").read_text(encoding="utf-8")
    methods = (root / "docs" / "methods" / "dynamics.md").read_text(encoding="utf-8")
    friction = methods[methods.index("| term | column | parameter | unit |") :]
    found: dict[str, str] = {}
    for table in (
        text[text.index("| name | unit |") : text.index("## robot.yaml")],
        friction.split("\n\n")[0],
    ):
        for row in table.splitlines()[2:]:
            if row:
                *_, names, unit, _ = (cell.strip() for cell in row.split("|"))
                found |= dict.fromkeys(re.findall(r"`([^`]+)`", names), unit)
    return found


def pattern(name: str) -> str:
    name = (
        re.escape(name)
        .replace("<joint>", r"joint_\d")
        .replace("<motor>", r"joint_\d")
        .replace("<link>", r"link_\d")
    )
    return name.replace("<name>", r"\w+").replace("<k>", r"\d+")


def produced(model: RobotModel) -> dict[str, str]:
    """Every name that the program gives a value on the TX90L, with its unit."""
    lines = 30
    config = ArmSensorConfig(frame="flange", xyz=(0.0, 0.0, 0.0), direction=(0.0, 0.0, 1.0))
    sensor = ArmSensor("hand", 5, np.zeros(3), np.array([0.0, 0.0, 1.0]), True, 2, config)
    model = replace(model, sensors={"hand": sensor})
    response = FrequencyResponse(
        frequencies_hz=np.arange(1.0, lines + 1),
        response=np.tile(np.eye(3, dtype=complex), (lines, 1, 1)),
        covariance=np.tile(1e-6 * np.eye(9, dtype=complex), (lines, 1, 1)),
        noise_covariance=np.tile(1e-7 * np.eye(9, dtype=complex), (lines, 1, 1)),
        degrees_of_freedom=45.0,
        realisations=np.tile(np.eye(3, dtype=complex), (4, lines, 1, 1)),
        joints=("joint_1", "joint_2", "joint_3"),
        q_mean=np.zeros(6),
        payload=None,
        pose=0,
        sample_time=2.5e-4,
        sensors=("hand",),
        sensor_response=np.ones((lines, 1, 3), dtype=complex),
        joint_covariance=np.tile(1e-6 * np.eye(12, dtype=complex), (lines, 1, 1)),
    )
    gains = [gain_name(joint) for joint in model.joint_names]
    servos = [actuator_name("joint_1", key) for key in Actuators.KEYS]
    forked = replace(model, joints=(*model.joints[:-1], replace(model.joints[-1], parent=3)))
    loops = [*(f"loop.four_bar.{key}" for key in LOOP), f"joint_3.{RATIO}joint_2"]
    names = {name: unit_of(name) for name in (*model.values, *forked.values, *gains, *loops, *servos)}
    return names | {
        item.name: item.unit
        for item in stiffness_parameters(model, [response], backlash=True, hysteresis=True)
    }


def test_every_name_is_in_the_table_with_its_unit(root: Path, tx90l: RobotModel) -> None:
    tx40 = RobotModel.from_yaml(root / "examples" / "tx40" / "robot.yaml", estimates=False)
    seen = tx40.with_lenses({"eye": np.zeros(9)})
    seen = replace(seen, stations=Stations.at_base((), ["cube"]))
    table, names = documented(root), {name: unit_of(name) for name in seen.values} | produced(tx90l)
    for name, unit in names.items():
        units = [known for written, known in table.items() if re.fullmatch(pattern(written), name)]
        assert units == [unit], name
    for written in table:
        assert any(re.fullmatch(pattern(written), name) for name in names), written
    assert {"joint_1.viscous.pose_1", "joint_2.drive.half_gap", "payload.com_z"} <= set(names)


def test_the_gap_is_as_wide_as_it_says(methods: str, tx90l: RobotModel, rng: np.random.Generator) -> None:
    from flexcal.design.poses import base_sensitivity, pose_sensitivity

    lower, upper = (np.array([getattr(joint, side) for joint in tx90l.joints]) for side in ("lower", "upper"))
    found = base_sensitivity(pose_sensitivity(tx90l, rng.uniform(lower, upper, (60, 6)))).identifiability
    assert found.rank == 29 and "rank is **29**" in methods
    said = re.search(r"(\w+) decades lie between the 29th", methods)
    assert said is not None and abs(found.gap - NUMBERS[said[1]]) < 1


def test_the_pooling_is_as_wide_as_it_says(methods: str) -> None:
    text = " ".join(methods.split())
    assert f"pooled over {POOLED_LINES} neighbouring lines ({3 * POOLED_LINES} degrees of freedom)" in text
    assert f"fewer than {SMALLEST_FREEDOM} are refused" in text


def test_the_page_on_exporting_has_every_format(root: Path) -> None:
    from flexcal.cli.arguments.verb_table import EXPORTS

    page = (root / "docs" / "exporting.md").read_text(encoding="utf-8")
    assert [verb.name for verb in EXPORTS if f"`{verb.name}`" not in page] == []


def test_the_page_on_files_has_those_that_verbs_leave(root: Path) -> None:
    from flexcal.cli.arguments.verb_table import VERBS

    page = (root / "docs" / "file-formats.md").read_text(encoding="utf-8")
    table = page[page.index("## What verbs leave") :].split("\n\n")[1].splitlines()[2:]
    assert table == [
        f"| `{verb.name}` | {', '.join(f'`{name}`' for name in verb.leaves)} |"
        for verb in VERBS
        if verb.leaves
    ]


def test_pages_and_their_equations_need_no_network(root: Path, tmp_path: Path) -> None:
    """Those without notebooks, built: whatever they load lies beside them, every equation is MathML, and every verb is there."""
    from flexcal.cli.arguments.verb_table import VERBS

    options = ["-D", "nb_execution_mode=off", "-D", "exclude_patterns=api.md,examples", "-b", "html"]
    command = [sys.executable, "-m", "sphinx", "-q", *options, str(root / "docs"), str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "equation" not in done.stderr, done.stderr
    pages = {page: page.read_text(encoding="utf-8") for page in tmp_path.rglob("*.html")}
    for path, page in pages.items():
        loaded = re.findall(r"<(?:script|img|iframe)\b[^>]*?\bsrc=\"([^\"]*)", page)
        loaded += re.findall(r"<link\b(?=[^>]*stylesheet)[^>]*?\bhref=\"([^\"]*)", page)
        assert len(loaded) > 5, path
        for address in loaded:
            assert (path.parent / address.split("?")[0]).is_file(), f"{path}: {address}"
    said = html.unescape(re.sub(r"<[^>]+>", "", pages[tmp_path / "command-line.html"]))
    assert [verb.example for verb in VERBS if verb.example not in said] == []
    styles = [sheet.read_text(encoding="utf-8") for sheet in tmp_path.glob("_static/**/*.css")]
    assert [sheet for sheet in styles if re.search(r"(@import|url\()\s*[\"']?(https?:)?//", sheet)] == []
    assert (tmp_path / "_static" / "STIXTwoMath-Regular.ttf").stat().st_size > 1e6
    written = {
        source: len(
            re.findall(
                r"\$\$.+?\$\$|\$[^$]+?\$",
                re.sub(r"`[^`]*`", "", source.read_text(encoding="utf-8")),
                re.DOTALL,
            )
        )
        for source in [*(root / "docs").glob("*.md"), *(root / "docs" / "methods").glob("*.md")]
        if source.name != "api.md"
    }
    assert sum(written.values()) > 300
    for source, count in written.items():
        built = tmp_path / source.relative_to(root / "docs").with_suffix(".html")
        assert pages[built].count("<math") == count, source


@pytest.fixture(scope="module")
def api(root: Path) -> str:
    return (root / "docs" / "api.md").read_text(encoding="utf-8")


def listed(api: str, directive: str) -> set[str]:
    return set(re.findall(rf"^\.\. {directive}:: (\S+)$", api, flags=re.MULTILINE))


def listed_data(api: str) -> set[tuple[str, str]]:
    """Module and name of what is neither class nor function."""
    found = re.findall(r"^\.\. py:data:: (\w+)\n   :module: (\S+)$", api, flags=re.MULTILINE)
    return {(module, name) for name, module in found}


def test_every_public_name_is_in_the_library_page(api: str) -> None:
    named = listed(api, "auto(?:function|class)") | {f"{module}.{name}" for module, name in listed_data(api)}
    assert {f"flexcal.{name}" for name in flexcal.__all__} == {name for name in named if name.count(".") == 1}
    assert listed(api, "automodule") == {"flexcal.report.figures"}
    for module, name in listed_data(api):
        assert hasattr(importlib.import_module(module), name)


def test_notebooks_use_public_names_only(root: Path, api: str) -> None:
    notebooks = sorted((root / "docs" / "examples").glob("*.md"))
    assert {page.stem for page in notebooks} == {
        folder.name for folder in (root / "examples").iterdir() if (folder / "robot.yaml").is_file()
    }
    whole = listed(api, "automodule")
    apart = listed(api, "auto(?:function|class)") | {f"{module}.{name}" for module, name in listed_data(api)}
    for page in notebooks:
        cells = blocks(page.read_text(encoding="utf-8"), r"\{code-cell\} python")
        imports = [
            node for cell in cells for node in ast.walk(ast.parse(cell)) if isinstance(node, ast.ImportFrom)
        ]
        for node in imports:
            if node.module is None or not node.module.startswith("flexcal"):
                continue
            public = importlib.import_module(node.module).__all__ if node.module in whole else ()
            for name in (alias.name for alias in node.names):
                assert name in public or f"{node.module}.{name}" in apart, (
                    f"{page.name}: {node.module}.{name}"
                )


def blocks(text: str, language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)


def test_own_data_take_four_commands(
    root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, ur5: RobotModel
) -> None:
    """Those of the page, in order, with the UR5's data under the names that it uses."""
    text = (root / "docs" / "start.md").read_text(encoding="utf-8")
    (robot,) = blocks(text, "yaml")
    commands = blocks(text, "sh")[-1].splitlines()
    monkeypatch.chdir(tmp_path)
    Path("robot.yaml").write_text(robot, encoding="utf-8")
    shutil.copy(ur5.urdf, "my_robot.urdf")
    data = root / "examples" / "ur5_tracker"
    pl.read_csv(data / "grid.csv").gather_every(7).write_csv("poses.csv")
    others = pl.read_csv(data / "random.csv")
    others.write_csv("others.csv")
    others.select("pose", *(f"q{i}" for i in range(1, 7))).write_csv("targets.csv")
    assert len(commands) == 4
    for command in commands:
        program, *arguments = shlex.split(command)
        assert program == "flexcal" and main(arguments) == 0, command
    found = json.loads(Path("verification/results.json").read_text(encoding="utf-8"))
    assert found["verification"]["measured"]["mean_mm"] < 0.2 < found["verification"]["nominal"]["mean_mm"]
    assert Path("calibration/report.html").exists() and Path("verification/report.html").exists()
    assert len(pl.read_csv("commands.csv")) == len(others)
    assert 'link name="reflector"' in Path("calibrated.urdf").read_text(encoding="utf-8")
