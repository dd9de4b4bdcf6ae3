"""`flexcal serve`."""

from __future__ import annotations

import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tyro.conf import arg

from flexcal.cli.arguments.shared_options import (
    Estimates,
    Json,
    MaybeCount,
    MaybePath,
    Robot,
    Temperature,
    require_robot,
)
from flexcal.cli.terminal.console import Console
from flexcal.errors import InputError


@dataclass(frozen=True)
class Serve:
    """Answer programs on this machine about a calibrated robot: commands and poses, line by line, in any language.

    A line is a JSON object such as {"q": [0, -0.5, 1.6, 0, 0.6, 0]}, and its answer one with "status", "done" or why not, and "command".
    "do" may be compensate, inverse, forward, nominal, torque or describe. It listens on a Unix socket that is yours alone,
    or on a TCP port of this machine, whose clients begin with the token. Ctrl-C stops it.
    """

    out: ClassVar[None] = None
    robot: Robot
    unix: Annotated[MaybePath, arg(metavar="SOCKET", help_behavior_hint="(or --port)")] = None
    """Unix socket to make."""
    port: Annotated[MaybeCount, arg(metavar="N", help_behavior_hint="(or --unix)")] = None
    """TCP port of 127.0.0.1; 0 takes any free one."""
    token: Annotated[Path, arg(metavar="FILE")] = Path("flexcal.token")
    """File of the token that clients of --port begin with, {"token": "…"}; made where it is absent."""
    temperature: Temperature = None
    estimates: Estimates = None
    json: Json = False

    def run(self) -> None:
        """Serve until stopped, and print how much was answered."""
        from flexcal.jobs.serving import Answers, serve_tcp, serve_unix

        require_robot(self.robot)
        if (self.unix is None) == (self.port is None):
            raise InputError("E-CLI-044", "give --unix SOCKET or --port N, one of them.")
        answers = Answers.from_yaml(self.robot, self.estimates, self.temperature)
        where: list[str] = []

        def ready(address: str) -> None:
            where.append(address)
            # standard output is shown when a verb has ended
            print(f"listening on {address}", file=sys.stderr, flush=True)
            for remark in answers.remarks:
                print(remark, file=sys.stderr, flush=True)

        if self.unix is not None:
            served = serve_unix(answers, self.unix, ready)
        else:
            assert self.port is not None
            served = serve_tcp(answers, self.port, self.token, ready)
        console = Console(self.json)
        console.say(
            f"{served.answers} lines answered, {served.connections} connections, {served.refused} of them closed with a sentence"
        )
        console.finish({"address": where[0], **asdict(served)}, "start it again the same way")
