"""The cases: command lines of every verb, the files that they read, and for each number one case, always the same."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

from fuzz_mutations import (
    NUMBERS,
    ODD_TEXTS,
    Mutation,
    by_arrays,
    by_bytes,
    by_cells,
    by_image,
    by_json,
    by_members,
    by_numbers,
    by_rows,
    by_words,
    by_xml,
    by_yaml_structure,
    by_yaml_text,
    damaged,
)
from fuzz_recordings import by_counts, by_names, by_statements, by_universal_fields, by_values
from fuzz_surroundings import HOSTILE_NAMES, INTRUSIONS, KINDS

_YAML = (by_bytes, by_yaml_text, by_yaml_structure, by_numbers)
_PROGRAM = (by_bytes, by_words, by_numbers)
_RECORDING = (by_bytes, by_counts, by_names, by_values)
MUTATIONS: dict[str, tuple[Mutation, ...]] = {
    ".yaml": _YAML,
    ".urdf": (by_bytes, by_numbers, by_xml),
    ".xacro": (by_bytes, by_words, by_xml),
    ".csv": (by_bytes, by_cells),
    ".txt": (by_bytes, lambda content: by_cells(content, ";")),
    ".npz": (by_bytes, by_arrays),
    ".json": (by_bytes, by_json),
    **dict.fromkeys((".script", ".src", ".dat", ".mod", ".ls"), _PROGRAM),
    ".png": (by_bytes, by_image),
    **dict.fromkeys((".jpg", ".bmp", ".tiff", ".stl", ".mat"), (by_bytes, by_counts)),
    ".xlsx": (by_bytes, by_members),
    ".uff": (by_bytes, by_universal_fields, by_values),
    **dict.fromkeys((".bag", ".mcap"), _RECORDING),
    ".db3": (*_RECORDING, by_statements),
    "": (by_bytes,),
}
"""By the ending of a file's name."""


@dataclass(frozen=True)
class Line:
    """A command line, the files that it `reads`, and patterns of the places besides --out that it `writes`."""

    text: str
    reads: tuple[str, ...]
    writes: tuple[str, ...] = ()

    @property
    def serves(self) -> bool:
        """Whether it runs until it is interrupted."""
        return self.text.startswith(("serve", "studio"))

    @property
    def partly(self) -> bool:
        """Whether it may refuse a part of what is asked and write the rest."""
        return self.text.startswith("fleet")


_GROUPS = {
    "@arm": "robot.yaml arm.urdf",
    "@used": "robot.yaml arm.urdf results/estimates.yaml results/estimates.npz",
    "@irb": "irb/robot.yaml irb/arm.urdf irb/estimates.yaml irb/estimates.npz",
    "@frequency": "frequency/plan.yaml frequency/pose_1_realisation_1_experiment_1_plus.parquet",
    "@responses": "responses/plan.yaml responses/response_pose_1.npz",
    "@robot": "fleet/robot_0/robot.yaml fleet/robot_0/arm.urdf fleet/robot_0/results/estimates.yaml fleet/robot_0/results/estimates.npz",
    "@beside": "estimates.yaml estimates.npz results/estimates.yaml results/estimates.npz",
}
_TABLE = """
export urdf robot.yaml --out new.urdf
  @used
export mjcf robot.yaml --out new.xml
  @used
export sdf robot.yaml --out new.sdf
  @used
export dh robot.yaml --out new.csv
  @used
export mdh robot.yaml --out new.csv
  @used
export json robot.yaml --out new.json
  @used
export offsets robot.yaml --out new.csv
  @used
export kinematics irb/robot.yaml --out new.yaml
  @irb
export isaac servo/robot.yaml --out new.json
  servo/robot.yaml servo/arm.urdf
export runtime robot.yaml --out new.json
  @used
export xacro robot.yaml --out new
  @used
export xacro robot.yaml --xacro arm.xacro --out new
  arm.xacro @used
export lerobot robot.yaml --calibration motors.json --out new.json
  motors.json @used
init arm.urdf --out new
  arm.urdf
init arm.xacro --out new
  arm.xacro
import robot.yaml foreign.txt --out new.csv
  foreign.txt foreign.txt robot.yaml
import robot.yaml poses.csv --out new.csv
  poses.csv poses.csv robot.yaml
import robot.yaml log.csv --out new.csv
  log.csv log.csv robot.yaml
import robot.yaml measured.parquet --out new.csv
  measured.parquet measured.parquet robot.yaml
import robot.yaml measured.mat --out new.csv
  measured.mat measured.mat robot.yaml
import robot.yaml measured_hdf5.mat --out new.csv
  measured_hdf5.mat measured_hdf5.mat robot.yaml
import robot.yaml measured.xlsx --out new.csv
  measured.xlsx measured.xlsx robot.yaml
import robot.yaml measured.uff --out new.csv
  measured.uff measured.uff robot.yaml
import robot.yaml measured_binary.uff --out new.csv
  measured_binary.uff measured_binary.uff robot.yaml
import robot.yaml recorded.bag --out new.csv
  recorded.bag recorded.bag robot.yaml
import robot.yaml recorded.mcap --out new.csv
  recorded.mcap recorded.mcap robot.yaml
import robot.yaml recorded.db3 --out new.csv
  recorded.db3 recorded.db3 robot.yaml
import robot.yaml bag_mcap --out new.csv
  bag_mcap/metadata.yaml bag_mcap/bag_mcap.mcap
import robot.yaml bag_db3 --out new.csv
  bag_db3/metadata.yaml bag_db3/bag_db3.db3
import robot.yaml ticks.csv --lerobot motors.json --out new.csv
  motors.json ticks.csv
design trajectory robot.yaml --count 1 --duration 5 --searches 1 --steps 1 --harmonics 2 --out new.yaml
  @arm block.stl
identify inertials robot.yaml exciting
  @arm exciting/plan.yaml > @beside
identify gains robot.yaml log.csv loaded.csv --out new
  @arm log.csv loaded.csv
identify actuators servo/robot.yaml servo/moves.csv --out new
  servo/robot.yaml servo/moves.csv
identify dynamics robot.yaml log.csv --out new
  @arm log.csv
identify payload robot.yaml loaded.csv --free log.csv --out new
  @used log.csv loaded.csv
design frequency robot.yaml --poses frequency_poses.csv --out new.yaml
  @used frequency_poses.csv
export excitation plan.yaml --robot robot.yaml --out new
  plan.yaml robot.yaml @arm
measure plan.yaml --cell virtual --robot robot.yaml --config cell.yaml --out new
  plan.yaml cell.yaml @arm
measure plan.yaml --cell virtual --robot robot.yaml --config cell.yaml --out new --truth frequency/truth.yaml
  frequency/truth.yaml plan.yaml
measure frequency/plan.yaml --cell frequency --robot robot.yaml --out new
  @frequency robot.yaml
identify response robot.yaml frequency --out new
  @frequency @arm
identify response --input tau1 --output q1 --out new random.csv
  random.csv
identify response --input tau1 --output q1 --out new measured.uff
  measured.uff
identify response --input tau1 --output q1 --out new measured_binary.uff
  measured_binary.uff
identify stiffness robot.yaml responses --out new
  @responses @arm
design poses robot.yaml --count 6 --candidates 30 --out new.yaml
  @used block.stl
design poses robot.yaml --from poses.csv --count 5 --out new.yaml
  poses.csv robot.yaml
calibrate robot.yaml poses.csv --terms kinematic --out new
  @used poses.csv
calibrate robot.yaml poses.csv --terms kinematic
  poses.csv robot.yaml > @beside
calibrate robot.yaml poses.csv --terms kinematic --out results
  results/.flexcal poses.csv > results/*
design poses irb/robot.yaml --prior prior.yaml --count 6 --candidates 30 --out new.yaml
  prior.yaml irb/robot.yaml
calibrate eye/robot.yaml eye/images --out new
  eye/robot.yaml eye/images/joints.csv eye/images/0.png eye/images/1.jpg eye/images/4.bmp eye/images/5.tiff
identify tool robot.yaml touches.csv --frame flange --out new
  @used touches.csv
identify frame robot.yaml fixture.csv --out new
  @used fixture.csv
verify robot.yaml others.csv --out new
  @used others.csv
repeatability robot.yaml visits.csv --out new
  @used visits.csv
recheck robot.yaml others.csv --out recheck
  recheck/visits.json others.csv results/estimates.yaml > recheck/*
map robot.yaml --verification others.csv --count 20 --out new.html
  @used others.csv
compensate robot.yaml targets.csv --out new.csv
  @used targets.csv
filter irb/robot.yaml irb/pick.mod --out new.mod
  irb/pick.mod irb/pick.mod irb/estimates.yaml
filter irb/robot.yaml irb/pick.script --out new.script
  irb/pick.script irb/pick.script irb/estimates.yaml
filter irb/robot.yaml irb/weld.ls --out new.ls
  irb/weld.ls irb/weld.ls irb/estimates.yaml
filter irb/robot.yaml irb/pick.src --out new
  irb/pick.src irb/pick.dat
predict robot.yaml commands.csv --out new.csv
  @used commands.csv
certificate robot.yaml --targets targets.csv --before visits.csv --after after.csv --out new.html
  targets.csv visits.csv after.csv robot.yaml
report results
  results/results.json results/points.csv results/arm.npz results/gravity_loads.npz > results/*
report results --customer
  results/results.json results/points.csv results/.flexcal > results/*
report verification --customer
  verification/results.json verification/points.csv > verification/*
report fleet/robot_0/results --compare fleet/robot_1/results
  fleet/robot_0/results/results.json fleet/robot_1/results/results.json > fleet/robot_0/results/*
report responses
  responses/results.json responses/response_pose_1.npz > responses/*
report recheck
  recheck/results.json > recheck/*
fleet fleet --prior new_prior.yaml --out new.csv
  @robot fleet/robot_0/results/results.json > new_prior.yaml
study study.yaml --jobs 1 --out new
  study.yaml robot.yaml poses.csv
serve robot.yaml --unix new.sock
  @used > new.sock
studio project --port 0 --no-browser
  project/robot.yaml project/arm.urdf > project/*
demo --plan quick --seed 3 --out results
  results/.flexcal
completion bash
  robot.yaml
"""
"""Command lines, every verb in one; indented below, what each reads and, after >, writes besides --out."""


def _lines() -> Iterator[Line]:
    rows = _TABLE.strip().splitlines()
    for text, files in zip(rows[::2], rows[1::2], strict=True):
        for group, names in _GROUPS.items():
            files = files.replace(group, names)
        reads, _, writes = files.partition(">")
        yield Line(text, tuple(reads.split()), tuple(writes.split()))


LINES = tuple(_lines())


@dataclass(frozen=True)
class Case:
    """A command line on the arm's files, of which some have another content, name or kind, and things lie between that are not its own."""

    name: str
    line: Line
    arguments: tuple[str, ...]
    contents: dict[str, bytes] = field(default_factory=dict)
    kind: tuple[str, str] | None = None
    """File and the name in `KINDS` of what is in its place."""
    names: dict[str, str] = field(default_factory=dict)
    """Other names of files."""
    intrusions: tuple[tuple[str, str], ...] = ()
    """Folders and names in `INTRUSIONS`."""
    said: str = ""

    def words(self) -> tuple[str, ...]:
        return tuple(self.names.get(word, word) for word in self.arguments)


@cache
def ways(path: Path) -> tuple[tuple[tuple[str, Callable[[], bytes]], ...], ...]:
    """Labels and makers of the broken contents of a file, by mutation."""
    if path.suffix == ".parquet":  # polars starts threads, which a warm process must not have
        made = tuple((other.name, other.read_bytes) for other in sorted(variants_of(path).iterdir()))
        return tuple(by_bytes(path.read_bytes())), made
    return tuple(tuple(mutation(path.read_bytes())) for mutation in MUTATIONS[suffix_of(path)])


def write_variants(folder: Path) -> None:
    """Broken contents of the Parquet files of a folder, beside it."""
    for path in folder.rglob("*.parquet"):
        for label, make in by_rows(path.read_bytes()):
            variants_of(path).mkdir(parents=True, exist_ok=True)
            (variants_of(path) / label).write_bytes(make())


def variants_of(path: Path) -> Path:
    seeds = next(above for above in path.parents if above.name == "seeds")
    return seeds.with_name("variants") / path.name


def suffix_of(path: Path) -> str:
    return path.suffix if path.suffix in MUTATIONS else ""


def case_of(number: int, seeds: Path) -> Case:
    """The case of a number."""
    chance = random.Random(number)
    line = LINES[number % len(LINES)]
    arguments = tuple(line.text.split())
    file = chance.choice([name for name in line.reads if (seeds / name).is_file()])
    case = Case(str(number), line, arguments)
    said = []
    draw = chance.random()
    if draw < 0.08:
        kind = chance.choice(list(KINDS))
        case = replace(case, kind=(file, kind))
        said.append(f"{file}: {kind}")
    elif draw < 0.95:
        content, label = (seeds / file).read_bytes(), "damaged"
        if draw < 0.75:
            label, make = chance.choice(chance.choice(ways(seeds / file)))
            content = make()
        if draw > 0.65:
            content = damaged(content, chance)
        case = replace(case, contents={file: content})
        said.append(f"{file}: {label}{' and damaged' if 0.65 < draw < 0.75 else ''}")
    if chance.random() < 0.15 and file in arguments:
        odd = chance.choice(HOSTILE_NAMES) + Path(file).suffix
        case = replace(case, names={file: str(Path(file).with_name(odd))})
        said.append(f"{file} is named {odd!r}")
    if chance.random() < 0.4:
        folders = sorted({str(Path(word).parent) for word in line.reads} | {".", "new"})
        chosen = tuple(
            (chance.choice(folders), chance.choice(list(INTRUSIONS))) for _ in range(chance.choice((1, 1, 3)))
        )
        case = replace(case, intrusions=chosen)
        said.append(f"intrusions {chosen}")
    numbers = [k for k, word in enumerate(arguments) if word.isdigit()]
    if numbers and chance.random() < 0.25:
        odd = chance.choice([*NUMBERS.values(), *ODD_TEXTS.values(), ""])
        at = chance.choice(numbers)
        if arguments[at - 1] in ("--candidates", "--count") and odd == NUMBERS["million"]:
            odd = "10000"  # a million are computed, in half a minute
        case = replace(case, arguments=(*arguments[:at], odd, *arguments[at + 1 :]))
    if chance.random() < 0.1:
        case = replace(case, arguments=(*case.arguments, "--json"))
    return replace(case, said="; ".join(said) or "valid")


def named_case(file: str, label: str, text: str, seeds: Path) -> Case:
    """The case of a mutation by its label."""
    found = [make for mutation in ways(seeds / file) for name, make in mutation if name == label]
    if not found:
        raise LookupError(f"{file}-{label} is not generated any more")
    line = next(
        (line for line in LINES if line.text == text),
        Line(text, (file,), ("results/*", "verification/*", "responses/*")),
    )
    return Case(f"{file}-{label}", line, tuple(text.split()), {file: found[0]()}, said=f"{file}: {label}")


def files_named(case: Case) -> list[str]:
    """Names one of which a refusal has to mention: of files that the line reads, their folders, or words of the command line."""
    read = [case.names.get(name, name) for name in case.line.reads]
    return [
        *("log", "recording"),
        *(Path(name).name for name in read),
        *(Path(name).parent.name for name in read if "/" in name),
        *(Path(word).stem for word in case.words()[1:] if len(word) > 2),
    ]
