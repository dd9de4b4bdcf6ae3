"""The server with friendly and hostile clients: garbage, long lines, kills, a thousand at once, and those without the token."""

from __future__ import annotations

import asyncio
import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from random import Random

import numpy as np
import pytest
from refusals import refused
from waiting import PATIENCE

from flexcal import CalibratedRobot, compensate, read_torque_model
from flexcal.cli.main import main
from flexcal.data.poses import ToolTargets
from flexcal.jobs.serving import Answers, serve_tcp, serve_unix, server

Q = [0.3, -1.2, 1.5, 0.1, 1.6, 0.2]


@pytest.fixture(scope="module")
def robot_file(examples: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A UR5 with estimates beside it."""
    folder = tmp_path_factory.mktemp("served")
    for name in ("robot.yaml", "ur5.urdf", "grid.csv"):
        (folder / name).write_bytes((examples / "ur5_tracker" / name).read_bytes())
    rows = (folder / "grid.csv").read_text().splitlines(keepends=True)
    (folder / "grid.csv").write_text("".join([rows[0], *rows[1::20]]))
    assert (
        main(
            [
                "calibrate",
                str(folder / "robot.yaml"),
                str(folder / "grid.csv"),
                "--out",
                str(folder),
                "--json",
            ]
        )
        == 0
    )
    return folder / "robot.yaml"


@contextmanager
def serving(*arguments: str | Path) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The server as a process of its own, and where it listens."""
    command = [sys.executable, "-m", "flexcal.cli.main", "serve", *map(str, arguments)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as server:
        assert server.stderr is not None
        try:
            said = server.stderr.readline()
            assert said.startswith("listening on "), said + server.stderr.read()
            yield server, said.removeprefix("listening on ").strip()
        finally:
            server.terminate()
            server.wait(PATIENCE)


class Client:
    """A connection that writes lines and reads answers."""

    def __init__(self, address: str) -> None:
        host, _, port = address.rpartition(":")
        self.socket = (
            socket.create_connection((host, int(port)), PATIENCE) if host else socket.socket(socket.AF_UNIX)
        )
        if not host:
            self.socket.connect(address)
            self.socket.settimeout(PATIENCE)
        self.file = self.socket.makefile("rb")

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *_: object) -> None:
        self.file.close()
        self.socket.close()

    def send(self, raw: bytes) -> None:
        self.socket.sendall(raw)

    def answer(self) -> dict[str, object] | None:
        """The next answer; None where the connection is closed."""
        try:
            line = self.file.readline()
        except ConnectionResetError:
            return None
        return json.loads(line) if line else None

    def ask(self, **request: object) -> dict[str, object]:
        self.send(json.dumps(request).encode() + b"\n")
        found = self.answer()
        assert found is not None
        return found


def test_answers_are_those_of_the_library(robot_file: Path, tmp_path: Path) -> None:
    robot = CalibratedRobot.from_yaml(robot_file)
    targets = ToolTargets(np.array([1]), np.array(["smr"]), np.array([Q]))
    expected = compensate(robot, targets).commands.q[0]
    with serving(robot_file, "--unix", tmp_path / "s", "--json") as (server, address):
        assert (tmp_path / "s").stat().st_mode & 0o077 == 0
        with Client(address) as client:
            done = client.ask(id="a", q=Q)
            assert done["id"] == "a" and done["status"] == "done"
            np.testing.assert_allclose(done["command"], expected, rtol=0, atol=1e-8)
            wanted = client.ask(do="nominal", q=Q)
            there = client.ask(do="forward", q=done["command"], point="smr")
            np.testing.assert_allclose(there["position"], wanted["position"], rtol=0, atol=1e-11)
            back = client.ask(
                do="inverse", near=Q, **{key: wanted[key] for key in ("position", "quaternion_wxyz")}
            )
            np.testing.assert_allclose(back["command"], done["command"], rtol=0, atol=1e-9)
            assert client.ask(do="describe")["points"] == ["smr"]
            past = client.ask(q=[9.0] * 6)
            assert past["status"] == "a joint would be past its limit" and past["joint"] == "elbow_joint"
            server.send_signal(signal.SIGTERM)
            said, messages = server.communicate(timeout=PATIENCE)
            assert server.returncode == 0
            assert json.loads(said)["answers"] == 6
            assert "the server met" not in messages
    assert not (tmp_path / "s").exists()


NONSENSE = [
    b"\n",
    b"\x00\xff\xfe garbage\n",
    b"null\n",
    b"[1, 2, 3]\n",
    b"[" * 60000 + b"\n",
    b'{"q": [1, 2]}\n',
    b'{"q": [true, 0, 0, 0, 0, 0]}\n',
    b'{"q": [NaN, 0, 0, 0, 0, 0]}\n',
    b'{"q": [1e999, 0, 0, 0, 0, 0]}\n',
    b'{"q": [1' + b"0" * 400 + b", 0, 0, 0, 0, 0]}\n",
    b'{"q": [0, 0, 0, 0, 0, 0], "point": ["smr"]}\n',
    b'{"q": [0, 0, 0, 0, 0, 0], "payload": "heavy"}\n',
    b'{"q": [0, -1, 1, 0, 1, 0], "payload": 3}\n',
    b'{"q": [0, -1, 1, 0, 1, 0], "paylaod": 0}\n',
    b'{"q": [0, -1, 1, 0, 1, 0], "payload": -1}\n',
    b'{"do": "drop"}\n',
    b'{"do": {"a": 1}}\n',
    b'{"do": "inverse", "near": [0, -1, 1, 0, 1, 0], "position": [0, 0, 0], "quaternion_wxyz": [0, 0, 0, 0]}\n',
    b'{"do": "nominal", "q": [Infinity, 0, 0, 0, 0, 0]}\n',
    b"GET / HTTP/1.1\r\n",
]


@pytest.mark.parametrize("line", NONSENSE, ids=lambda line: line[:20].decode(errors="replace").strip())
def test_nonsense_is_answered_in_a_sentence(robot_file: Path, line: bytes) -> None:
    answers = Answers.from_yaml(robot_file)
    found = json.loads(answers.of(line))
    assert len(str(found["status"])) > 10 and found["status"] != "done" and "command" not in found
    assert json.loads(answers.of(json.dumps({"q": Q}).encode()))["status"] == "done"


ODD_VALUES = [
    *(
        "NaN",
        "Infinity",
        "-Infinity",
        "1e308",
        "-1e308",
        "1e200",
        "1e20",
        "1e7",
        "1e-320",
        "1e999",
        "-0.0",
        "true",
        "null",
    ),
    *(
        "1" + "0" * 400,
        "1" + "0" * 5000,
        '"x"',
        '"\\ud800"',
        '"\\u0000\\n\\u2028"',
        "[]",
        "{}",
        "[NaN]",
        '{"a": NaN}',
    ),
    *("[[" + 500 * "[" + 502 * "]", 3000 * "[", '"' + 200 * "y" + '"'),
]


SIZES = [*90 * [0], 1, 3, 5, 8, 150]


def odd_line(random: Random) -> bytes:
    """A request of which some values, and now and then some bytes, are not those of a client that means well."""

    def vector(length: int) -> str:
        values = [
            random.choice(ODD_VALUES)
            if random.random() < 0.02
            else repr(value * 10.0 ** random.choice(SIZES))
            for value in (Q + Q)[:length]
        ]
        return f"[{', '.join(values)}]"

    verb = random.choice(["compensate", "forward", "nominal", "torque", "inverse", "describe"])
    vectors = {"torque": {"q": 6, "dq": 6, "ddq": 6}, "inverse": {"near": 6, "position": 3}}
    fields = {"do": f'"{verb}"', "id": random.choice([*ODD_VALUES, *9 * ["7", '"a"']])}
    fields |= {key: vector(length) for key, length in vectors.get(verb, {"q": 6}).items()}
    if verb == "inverse":
        fields["quaternion_wxyz"] = random.choice(["[1, 0, 0, 0]", vector(4)])
    for key in ("point", "payload", "do", "q"):
        if random.random() < 0.05:
            fields[key] = random.choice(ODD_VALUES)
    line = bytearray("{" + ", ".join(f'"{key}": {value}' for key, value in fields.items()) + "}", "utf-8")
    if random.random() < 0.2:
        for _ in range(3):
            line[random.randrange(len(line))] = random.randrange(256)
    if random.random() < 0.1:
        del line[random.randrange(len(line)) :]
    return bytes(line).replace(b"\n", b" ") + b"\n"


def test_every_odd_line_gets_one_line(robot_file: Path) -> None:
    """What is not finite, and what no joint can be, is a status: nothing overflows on the way."""
    answers, random = Answers.from_yaml(robot_file), Random(4)
    done = 0
    with np.errstate(all="raise", under="ignore"):
        for _ in range(3000):
            line = odd_line(random)
            answer = answers.of(line)
            assert answer.index(b"\n") == len(answer) - 1, line
            found = json.loads(answer, parse_constant=pytest.fail)
            assert isinstance(found["status"], str), line
            done += found["status"] == "done"
    assert 600 < done < 2400


@pytest.mark.parametrize(("key", "size"), [("q", 2e5), ("dq", -2e5), ("ddq", 1e8)])
def test_motions_of_no_joint_are_refused(robot_file: Path, key: str, size: float) -> None:
    motion = {"q": Q, "dq": [0.0] * 6, "ddq": [0.0] * 6}
    motion[key] = [0.0, size, 0.0, 0.0, 0.0, 0.0]
    found = json.loads(
        Answers.from_yaml(robot_file).of(json.dumps({"id": 3, "do": "torque", **motion}).encode())
    )
    assert found["id"] == 3 and found["status"].startswith(
        f"'{key}' has a number that is not finite, or beyond ±"
    )


async def lines_of(port: int, *lines: bytes) -> list[str]:
    """Statuses that a client is answered, until the server closes or as many as it sent."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    writer.write(b"".join(lines))
    statuses = []
    while len(statuses) < max(1, len(lines)) and (line := await reader.readline()):
        statuses.append(json.loads(line)["status"])
    writer.close()
    return statuses


def test_strangers_are_closed_and_keep_no_client_out(
    robot_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Connections that never send the token have a time and a number of their own."""
    monkeypatch.setattr(server, "_TOKEN_WAIT", 0.5)
    monkeypatch.setattr(server, "_MOST_STRANGERS", 8)
    monkeypatch.setattr(server, "_MOST_CLIENTS", 1)
    token, served = b'{"token": "secret"}\n', server._Server(Answers.from_yaml(robot_file), "secret")

    async def attacked() -> None:
        async with await asyncio.start_server(served.connected, "127.0.0.1", 0) as listener:
            port = listener.sockets[0].getsockname()[1]
            silent = [await asyncio.open_connection("127.0.0.1", port) for _ in range(40)]
            assert await lines_of(port, token, b'{"do": "describe"}\n') == ["done", "done"]
            evicted, waited_for = await silent[0][0].read(), await silent[-1][0].read()
            assert b"too many connections have not sent the token" in evicted
            assert b"no token came within 0.5 s" in waited_for
            assert await lines_of(port, token, b"\n") == ["done", "the line is no JSON document"]

    asyncio.run(attacked())
    assert served.served.refused == 40


def test_a_line_on_which_the_server_fails_is_answered_too(capsys: pytest.CaptureFixture[str]) -> None:
    class Broken(Answers):
        def __init__(self) -> None:
            pass

        def of(self, line: bytes) -> bytes:
            raise ArithmeticError("\x1b[31m\n")

    served = server._Server(Broken(), None)
    assert {json.loads(served._answer(b"{}\n"))["status"] for _ in range(3)} == {
        "this line made the server fail, which is a fault of flexcal; it answers the next"
    }
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "ArithmeticError: '\\x1b[31m\\n'" in said


def test_no_client_disturbs_the_others(robot_file: Path, tmp_path: Path) -> None:
    """Long lines, half lines, clients that never read, that are killed, and a thousand at once."""
    with serving(robot_file, "--unix", tmp_path / "s") as (server, address), Client(address) as steady:
        with Client(address) as client:
            client.send(b'{"q": [' + b"0, " * 60000)
            found = client.answer()
            assert found is not None and "longer than 65536 bytes" in str(found["status"])
            assert client.answer() is None
        assert steady.ask(q=Q)["status"] == "done"
        deaf = Client(address)
        deaf.socket.settimeout(2)
        with pytest.raises(TimeoutError):
            while True:  # answers that nobody reads: the server stops reading from here
                deaf.send(b'{"do": "describe"}\n' * 1000)
        assert steady.ask(q=Q)["status"] == "done"
        child = (
            "import socket, sys; s = socket.socket(socket.AF_UNIX); s.connect(sys.argv[1]); "
            "s.sendall(b'{\"q\": [0,'); print('up', flush=True); sys.stdin.read()"
        )
        with subprocess.Popen(
            [sys.executable, "-c", child, address], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        ) as other:
            assert other.stdout is not None and other.stdout.readline() == "up\n"
            other.kill()
        assert steady.ask(q=Q)["status"] == "done"
        with ExitStack() as stack:
            crowd = [stack.enter_context(Client(address)) for _ in range(400)]
            script = (
                "import json, resource, socket, sys\n_, most = resource.getrlimit(resource.RLIMIT_NOFILE)\n"
                "resource.setrlimit(resource.RLIMIT_NOFILE, (900, most))\n"
                "crowd = []\nfor _ in range(600):\n    s = socket.socket(socket.AF_UNIX)\n"
                "    s.connect(sys.argv[1]); crowd.append(s)\n"
                f"line = json.dumps({{'q': {Q}}}).encode() + b'\\n'\nfor s in crowd: s.sendall(line)\n"
                "print(sum(b'done' in s.makefile('rb').readline() for s in crowd))"
            )
            found = subprocess.run(
                [sys.executable, "-c", script, address], capture_output=True, text=True, check=True
            )
            assert found.stdout.strip() == "600", found.stderr
            for client in crowd:
                client.send(json.dumps({"q": Q}).encode() + b"\n")
            assert all((client.answer() or {}).get("status") == "done" for client in crowd)
        deaf.__exit__()
        assert steady.ask(q=Q)["status"] == "done" and server.poll() is None


def test_a_port_asks_for_the_token(robot_file: Path, tmp_path: Path) -> None:
    file = tmp_path / "token"
    with serving(robot_file, "--port", "0", "--token", file) as (_, address):
        assert re.fullmatch(r"127\.0\.0\.1:\d+", address) and file.stat().st_mode & 0o077 == 0
        token = file.read_text().strip()
        assert len(token) > 30
        for first in (
            b'{"q": [0, 0, 0, 0, 0, 0]}\n',
            b'{"token": "x"}\n',
            b'{"token": 1}\n',
            b"POST / HTTP/1.1\r\n",
            b'"\n',
        ):
            with Client(address) as stranger:
                stranger.send(first)
                found = stranger.answer()
                assert found is not None and "token" in str(found["status"])
                assert stranger.answer() is None
        with Client(address) as client:
            assert client.ask(token=token)["status"] == "done"
            assert client.ask(q=Q)["status"] == "done"
    again = file.read_text().strip()
    with serving(robot_file, "--port", "0", "--token", file):
        assert file.read_text().strip() == again == token


def test_a_socket_of_a_killed_server_is_taken_over(robot_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "s"
    with serving(robot_file, "--unix", path) as (server, address):
        answers = Answers.from_yaml(robot_file)
        with refused("E-SERVE-005", str(path)):
            serve_unix(answers, path, print)
        os.kill(server.pid, signal.SIGKILL)
        server.wait(PATIENCE)
        assert path.exists()
    with serving(robot_file, "--unix", path) as (_, address), Client(address) as client:
        assert client.ask(q=Q)["status"] == "done"


def test_places_that_cannot_be_listened_on_are_refused(
    robot_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answers = Answers.from_yaml(robot_file)
    with refused("E-SERVE-001"):
        serve_unix(answers, tmp_path / "nowhere" / "s", print)
    with refused("E-SERVE-003"):
        serve_unix(answers, tmp_path / ("s" * 120), print)
    (tmp_path / "file").write_text("mine")
    with refused("E-SERVE-004", str(tmp_path / "file")):
        serve_unix(answers, tmp_path / "file", print)
    assert (tmp_path / "file").read_text() == "mine"
    (tmp_path / "file").chmod(0o644)
    with refused("E-SERVE-006"):
        serve_tcp(answers, 0, tmp_path / "file", print)
    (tmp_path / "file").chmod(0o600)
    (tmp_path / "file").write_text("\n")
    with refused("E-SERVE-007"):
        serve_tcp(answers, 0, tmp_path / "file", print)
    os.mkfifo(tmp_path / "pipe", 0o600)
    with refused("E-FILE-014", str(tmp_path / "pipe")):
        serve_tcp(answers, 0, tmp_path / "pipe", print)
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        with refused("E-SERVE-002"):
            serve_tcp(answers, taken.getsockname()[1], tmp_path / "token", print)
    for options in ([], ["--unix", "s", "--port", "1"]):
        assert main(["serve", str(robot_file), *options]) == 2
        assert "E-CLI-044" in capsys.readouterr().err


def test_torques_are_those_of_the_library(robot_file: Path) -> None:
    q, dq, ddq = Q, [0.1] * 6, [-0.5] * 6
    answers = Answers.from_yaml(robot_file)
    found = json.loads(answers.of(json.dumps({"do": "torque", "q": q, "dq": dq, "ddq": ddq}).encode()))
    expected = read_torque_model(robot_file).torque(*(np.array([values]) for values in (q, dq, ddq)))
    np.testing.assert_allclose(found["torque"], expected[0], rtol=0, atol=1e-9)
