"""Programs in C and C++ that were written against an installed runtime, the examples, and memory checks."""

from __future__ import annotations

import ctypes
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from flexcal.dynamics.torque_model import TorqueModel
from flexcal.export import render_runtime
from flexcal.kernels import RuntimeRobot
from flexcal.model.robot import RobotModel

Q = [0.3, 0.5, 1.2, 0.4, 0.9, -0.5]
FAR = [0.6, *Q[1:]]
HOLDS = {"smr": np.array([[-np.inf, *[-2.0] * 5], [0.5, *[np.inf] * 5]])}
WARNINGS = "-Wall -Wextra -Wpedantic -Wshadow -Werror"
COMPILER = shutil.which("g++")
CMAKE = Path(sys.executable).with_name("cmake")
pytestmark = pytest.mark.skipif(
    COMPILER is None or not CMAKE.exists(), reason="needs g++ and the environment's cmake"
)

PROJECT = """cmake_minimum_required(VERSION 3.18)
project(user LANGUAGES C CXX)
find_package(flexcal_runtime 1.0 REQUIRED)
add_executable(in_cpp in_cpp.cpp)
target_link_libraries(in_cpp PRIVATE flexcal_runtime::flexcal_runtime)
add_executable(in_c in_c.c)
target_link_libraries(in_c PRIVATE flexcal_runtime::flexcal_runtime_c)
"""
IN_CPP = """#include <cstdio>
#include <cstdlib>
#include <new>
#include <flexcal/runtime.hpp>
#include "robot.hpp"
static long allocations = 0;
void* operator new(std::size_t size) { ++allocations; if (void* p = std::malloc(size)) return p; std::abort(); }
void operator delete(void* p) noexcept { std::free(p); }
void operator delete(void* p, std::size_t) noexcept { std::free(p); }
int main() {
    std::string error;
    const auto model = flexcal::runtime::read_model(flexcal_robot, error);
    if (!model) return std::puts(error.c_str()), 1;
    flexcal::runtime::Solver solver(*model);
    const double q[] = {0.3, 0.5, 1.2, 0.4, 0.9, -0.5};
    double command[6];
    const long before = allocations;
    for (int k = 0; k < 100; ++k) {
        double moved[6];
        for (int j = 0; j < 6; ++j) moved[j] = q[j] - 0.01 * k;
        flexcal::runtime::Pose pose;
        double torque[6];
        (void)solver.forward(moved, 0, pose);
        (void)solver.nominal(moved, 0, pose);
        (void)solver.torque(moved, q, q, torque, true);
        (void)solver.compensate(moved, 0, command);
        (void)solver.set_payload(0.01 * k);
        (void)model->beyond(moved, 0);
    }
    const long made = allocations - before;
    if (solver.set_payload(2) != flexcal::runtime::Status::ok) return 1;
    if (solver.compensate(q, model->point("smr"), command) != flexcal::runtime::Status::ok) return 1;
    for (double value : command) std::printf("%.17g ", value);
    std::printf("%ld", made);
}
"""
IN_C = """#include <stdio.h>
#include <flexcal_runtime.h>
int main(int count, char** arguments) {
    char error[200];
    const double q[] = {0.3, 0.5, 1.2, 0.4, 0.9, -0.5};
    double command[6];
    flexcal_model* model = count > 1 ? flexcal_model_read_file(arguments[1], error, sizeof error) : NULL;
    if (!model) return printf("%s", error), 1;
    flexcal_solver* solver = flexcal_solver_new(model);
    int status = flexcal_set_payload(solver, 2.0);
    if (status == FLEXCAL_OK) status = flexcal_compensate(solver, q, flexcal_model_point(model, "smr"), command);
    if (status == FLEXCAL_OK)
        for (int i = 0; i < flexcal_model_joints(model); ++i) printf("%.17g ", command[i]);
    else
        printf("%s", flexcal_describe(status));
    flexcal_solver_free(solver);
    flexcal_model_free(model);
    return status;
}
"""


def run(*command: str | Path, **options: object) -> str:
    """Standard output of a command that succeeds."""
    done = subprocess.run([str(part) for part in command], capture_output=True, text=True, **options)  # type: ignore[call-overload]
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def texts(tx90l: RobotModel) -> tuple[str, str]:
    """The elastic robot for the runtime, as JSON and as a header."""
    real = tx90l.with_values({"joint_2.offset": 1e-3, "joint_3.length_x": 4e-4, "joint_2.backlash": 5e-5})
    drives = TorqueModel.of(real).document()
    json_text, header = (
        render_runtime(real, tx90l, drives, holds=HOLDS, header=header) for header in (False, True)
    )
    return json_text.text, header.text


@pytest.fixture(scope="module")
def robot_file(texts: tuple[str, str], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("runtime") / "robot.json"
    path.write_text(texts[0])
    return path


@pytest.fixture(scope="module")
def page(root: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[str]]:
    """A folder where the commands of docs/runtime.md ran in order, with what they take from the repository, and the lines that they said.

    All warnings are errors, and there are no exceptions.
    """
    folder = tmp_path_factory.mktemp("page")
    text = (root / "docs" / "runtime.md").read_text(encoding="utf-8")
    (commands,) = re.findall(r"^```sh\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)
    (folder / "examples").symlink_to(root / "examples")
    (folder / "runtime").symlink_to(root / "runtime")
    found = {
        "PATH": f"{CMAKE.parent}{os.pathsep}{os.environ['PATH']}",
        "CXXFLAGS": f"{WARNINGS} -fno-exceptions",
    }
    said = run("bash", "-e", "-c", commands, cwd=folder, env=os.environ | found)
    return folder, said.splitlines()


@pytest.fixture(scope="module")
def built(page: tuple[Path, list[str]]) -> Path:
    """The build of the page with the library for C shared, and installed under `prefix`."""
    folder = page[0] / "ur5" / "build"
    run(CMAKE, "-DBUILD_SHARED_LIBS=ON", folder)
    run(CMAKE, "--build", folder)
    run(CMAKE, "--install", folder, "--prefix", folder / "prefix")
    return folder


@pytest.fixture(scope="module")
def expected(texts: tuple[str, str]) -> np.ndarray:
    command, status, _ = RuntimeRobot.read(texts[0]).compensate(np.array([Q]), 0, np.array([2.0]))
    assert status[0] == 0
    return command[0]


def test_an_installed_runtime_is_found(
    built: Path, texts: tuple[str, str], robot_file: Path, expected: np.ndarray, tmp_path: Path
) -> None:
    """In C++ from a header of constants, without a single allocation in the loop, even where nothing is optimised; in C from a file."""
    for name, text in (
        ("CMakeLists.txt", PROJECT),
        ("in_cpp.cpp", IN_CPP),
        ("in_c.c", IN_C),
        ("robot.hpp", texts[1]),
    ):
        (tmp_path / name).write_text(text)
    run(CMAKE, "-S", tmp_path, "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={built / 'prefix'}")
    run(CMAKE, "--build", tmp_path / "build")
    *command, made = map(float, run(tmp_path / "build" / "in_cpp").split())
    np.testing.assert_allclose(command, expected, rtol=0, atol=1e-12)
    assert made == 0
    in_c = list(map(float, run(tmp_path / "build" / "in_c", robot_file).split()))
    np.testing.assert_allclose(in_c, expected, rtol=0, atol=1e-12)


def test_other_languages_load_the_shared_library(
    built: Path, robot_file: Path, expected: np.ndarray, tmp_path: Path
) -> None:
    library = ctypes.CDLL(str(next(built.glob("libflexcal_runtime_c.*"))))
    library.flexcal_model_read_file.restype = library.flexcal_solver_new.restype = ctypes.c_void_p
    library.flexcal_describe.restype = ctypes.c_char_p
    error = ctypes.create_string_buffer(200)
    assert not library.flexcal_model_read_file(b"nowhere.json", error, 200)
    assert error.value == b"nowhere.json cannot be read"
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "fifo")
        assert not library.flexcal_model_read_file(bytes(tmp_path / "fifo"), error, 200)
    model = ctypes.c_void_p(library.flexcal_model_read_file(bytes(robot_file), error, 200))
    solver = ctypes.c_void_p(library.flexcal_solver_new(model))
    command = (ctypes.c_double * 6)()
    assert library.flexcal_set_payload(solver, ctypes.c_double(2.0)) == 0
    assert library.flexcal_compensate(solver, (ctypes.c_double * 6)(*Q), 0, command) == 0
    np.testing.assert_allclose(list(command), expected, rtol=0, atol=1e-12)
    assert [library.flexcal_beyond(model, (ctypes.c_double * 6)(*q), 0) for q in (Q, FAR)] == [0, 1]
    kept = list(command)
    status = library.flexcal_compensate(solver, (ctypes.c_double * 6)(*([9.0] * 6)), 0, command)
    assert library.flexcal_describe(status) == b"a joint would be past its limit"
    assert list(command) == kept


def test_the_filter_answers_every_line(built: Path, robot_file: Path, expected: np.ndarray) -> None:
    lines = [
        json.dumps({"q": Q, "payload": 2.0}),
        "",
        '{"q": [1, 2]}',
        json.dumps({"q": [9.0] * 6}),
        json.dumps({"q": Q, "point": "nowhere"}),
        json.dumps({"q": Q, "payload": -1}),
        "[" * 5000,
        '{"q": [0, 0, 0, 0, 0, 1e999]}',
        json.dumps({"q": FAR}),
        json.dumps({"q": Q}),
    ]
    answers = [
        json.loads(line)
        for line in run(built / "command_filter", robot_file, input="\n".join(lines) + "\n").splitlines()
    ]
    assert len(answers) == len(lines)
    np.testing.assert_allclose(answers[0]["command"], expected, rtol=0, atol=1e-12)
    np.testing.assert_allclose(answers[-1]["command"], expected, rtol=0, atol=1e-12)
    assert answers[-2]["status"] == "done" and answers[-2]["beyond"] and "beyond" not in answers[-1]
    for answer in answers[1:-2]:
        assert "command" not in answer and len(answer["status"]) > 10
    assert "joint" in answers[3]["status"]


def test_the_loop_tells_how_it_keeps_its_time(built: Path, robot_file: Path) -> None:
    said = run(built / "loop_1khz", robot_file, "0.2")
    assert (
        said.startswith("200 cycles\n") and ": done" in said and "compensation" in said and "99.99 %" in said
    )


def test_the_page_s_commands_do_what_they_say(page: tuple[Path, list[str]]) -> None:
    said = page[1]
    answer = json.loads(said[-1])
    assert (
        answer["status"] == "done"
        and np.abs(np.subtract(answer["command"], [0.3, -1.2, 1.5, 0.1, 1.6, 0.2])).max() < 0.05
    )
    assert sum(line.startswith(("forward", "command")) for line in said) == 4
