"""The broken files: which file of the arm is broken in which ways, and the command lines that read it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fuzz_mutations import (
    Mutation,
    by_arrays,
    by_bytes,
    by_cells,
    by_json,
    by_numbers,
    by_xml,
    by_yaml_structure,
    by_yaml_text,
)
from fuzz_recordings import by_counts, by_names, by_statements, by_universal_fields, by_values

Words = tuple[str, ...]


@dataclass(frozen=True)
class Subject:
    """A file that is broken by the `mutations`, and command lines that read it."""

    file: str
    mutations: tuple[Mutation, ...]
    lines: tuple[str, ...]


@cache
def broken_contents(subject: Subject, content: bytes) -> tuple[tuple[str, bytes], ...]:
    """Label and content of every mutation of a subject's `content`; made once, for they are thousands."""
    return tuple(labelled for mutation in subject.mutations for labelled in mutation(content))


@dataclass(frozen=True)
class Case:
    """A command line on the arm's files, one of which has another content."""

    name: str
    file: str
    content: bytes
    arguments: Words

    def lay_out(self, seeds: Path, folder: Path) -> None:
        """Copy the valid files and break one."""
        shutil.copytree(seeds, folder)
        (folder / self.file).write_bytes(self.content)


CALIBRATE = "calibrate robot.yaml poses.csv --terms kinematic --out new"
DYNAMICS = "identify dynamics robot.yaml log.csv --out new"
REPORT = "report results"
VIRTUAL = "--cell virtual --robot robot.yaml --config cell.yaml --out new"
_YAML = (by_bytes, by_yaml_text, by_yaml_structure, by_numbers)
_TABLE = (by_bytes, by_cells)
_RECORDING = (by_bytes, by_counts, by_names)
IMPORT = "import robot.yaml --out new.csv"
RESPONSE = "identify response --input tau1 --output q1 --out new"

SUBJECTS = (
    Subject(
        "robot.yaml",
        _YAML,
        (
            "export urdf robot.yaml --out new.urdf",
            CALIBRATE,
            DYNAMICS,
            "design poses robot.yaml --count 6 --candidates 30 --out new.yaml",
            "measure plan.yaml --robot robot.yaml --cell virtual --config cell.yaml --out new",
            "identify stiffness robot.yaml responses --out new",
            "compensate robot.yaml targets.csv --out new.csv",
            "import robot.yaml foreign.txt --out new.csv",
        ),
    ),
    Subject(
        "arm.urdf",
        (by_bytes, by_numbers, by_xml),
        ("export urdf robot.yaml --out new.urdf", "init arm.urdf --out new", DYNAMICS, CALIBRATE),
    ),
    Subject(
        "poses.csv",
        _TABLE,
        (
            CALIBRATE,
            "import robot.yaml poses.csv --out new.csv",
            "design poses robot.yaml --from poses.csv --count 5 --out new.yaml",
        ),
    ),
    Subject(
        "others.csv",
        _TABLE,
        (
            "verify robot.yaml others.csv",
            "map robot.yaml --verification others.csv --count 20 --out new.html",
        ),
    ),
    Subject("visits.csv", _TABLE, ("repeatability robot.yaml visits.csv",)),
    Subject(
        "targets.csv",
        _TABLE,
        (
            "compensate robot.yaml targets.csv --out new.csv",
            "certificate robot.yaml --targets targets.csv --before visits.csv --after after.csv --out new.html",
        ),
    ),
    Subject("commands.csv", _TABLE, ("predict robot.yaml commands.csv --out new.csv",)),
    Subject(
        "log.csv",
        _TABLE,
        (
            DYNAMICS,
            "identify payload robot.yaml log.csv --free validation.csv --out new",
            "identify gains robot.yaml log.csv validation.csv --out new",
            "import robot.yaml log.csv --out new.csv",
            f"{RESPONSE} log.csv",
        ),
    ),
    Subject(
        "foreign.txt",
        (by_bytes, lambda content: by_cells(content, ";")),
        ("import robot.yaml foreign.txt --out new.csv",),
    ),
    *(
        Subject(name, (by_bytes,), (f"import robot.yaml {name} --out new.csv",))
        for name in (*("measured.parquet", "measured.mat", "measured_hdf5.mat", "measured.xlsx"),)
    ),
    Subject(
        "measured.uff",
        (by_bytes, by_universal_fields),
        (f"{IMPORT} measured.uff", f"{RESPONSE} measured.uff"),
    ),
    Subject(
        "measured_binary.uff",
        (by_bytes, by_universal_fields, by_values),
        (f"{IMPORT} measured_binary.uff", f"{RESPONSE} measured_binary.uff"),
    ),
    Subject("recorded.bag", (*_RECORDING, by_values), (f"{IMPORT} recorded.bag",)),
    Subject("recorded.mcap", (*_RECORDING, by_values), (f"{IMPORT} recorded.mcap",)),
    Subject("recorded.db3", (*_RECORDING, by_statements), (f"{IMPORT} recorded.db3",)),
    *(
        Subject(f"bag_{ending}/{file}", ways, (f"{IMPORT} bag_{ending}",))
        for ending in ("mcap", "db3")
        for file, ways in (("metadata.yaml", _YAML), (f"bag_{ending}.{ending}", _RECORDING))
    ),
    Subject("cell.yaml", _YAML, (f"measure plan.yaml {VIRTUAL}",)),
    Subject("plan.yaml", _YAML, (f"measure plan.yaml {VIRTUAL}",)),
    Subject("frequency/plan.yaml", _YAML, ("identify response robot.yaml frequency --out new",)),
    Subject(
        "frequency/pose_1_realisation_1_experiment_1_plus.parquet",
        (by_bytes,),
        ("identify response robot.yaml frequency --out new",),
    ),
    Subject("frequency/truth.yaml", _YAML, (f"measure plan.yaml {VIRTUAL} --truth frequency/truth.yaml",)),
    Subject(
        "responses/response_pose_1.npz",
        (by_bytes, by_arrays),
        ("identify stiffness robot.yaml responses --out new",),
    ),
    Subject(
        "responses/plan.yaml",
        (by_bytes, by_yaml_text, by_numbers),
        ("identify stiffness robot.yaml responses --out new",),
    ),
    Subject(
        "results/estimates.yaml",
        _YAML,
        (
            "export urdf robot.yaml --out new.urdf",
            "verify robot.yaml others.csv --out new",
            "compensate robot.yaml targets.csv --out new.csv",
            CALIBRATE,
        ),
    ),
    Subject("results/estimates.npz", (by_bytes, by_arrays), ("export urdf robot.yaml --out new.urdf",)),
    Subject(
        "results/results.json",
        (by_bytes, by_json),
        (REPORT, "report results --customer", "report verification --compare results"),
    ),
    Subject(
        "verification/results.json",
        (by_bytes, by_json),
        ("report verification", "report verification --customer"),
    ),
    Subject("responses/results.json", (by_bytes, by_json), ("report responses",)),
    Subject("results/points.csv", _TABLE, (REPORT, "report results --customer")),
    Subject("results/arm.npz", (by_bytes, by_arrays), (REPORT,)),
    Subject("results/gravity_loads.npz", (by_bytes, by_arrays), (REPORT,)),
    Subject(
        "results/.flexcal",
        (by_bytes,),
        (REPORT, "calibrate robot.yaml poses.csv --terms kinematic --out results"),
    ),
)


def cases(seeds: Path, *, every_line: bool = False) -> Iterator[Case]:
    """Mutations of every subject that is among the `seeds`; the command lines take turns, or all of them read each with `every_line`."""
    for subject in SUBJECTS:
        if not (seeds / subject.file).is_file():
            continue
        content = (seeds / subject.file).read_bytes()
        for turn, (label, broken) in enumerate(broken_contents(subject, content)):
            lines = subject.lines if every_line else (subject.lines[turn % len(subject.lines)],)
            for line in lines:
                verb = line.partition(" ")[0] if len(lines) == 1 else "_".join(line.split()[:2])
                yield Case(f"{subject.file}-{label}-{verb}", subject.file, broken, tuple(line.split()))


def names_of(case: Case) -> list[str]:
    """Names one of which a refusal has to mention: of the broken file, its folder, or a file or folder on the command line."""
    named = [Path(case.file).name, case.file.partition("/")[0]]
    folders = ("results", "verification", "responses", "frequency")
    return [*named, *(word for word in case.arguments if "." in word or word in folders)]
