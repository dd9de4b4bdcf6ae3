"""`flexcal completion`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from tyro.conf import Positional, arg

from flexcal.cli.arguments.shared_options import Json, MaybePath
from flexcal.cli.terminal.console import Console

_INSTALLED = {
    "bash": "~/.local/share/bash-completion/completions/flexcal",
    "zsh": "a folder of your fpath, as _flexcal",
    "fish": "~/.config/fish/completions/flexcal.fish",
}


@dataclass(frozen=True)
class Completion:
    """Print a completion script for verbs, options and their choices; file names otherwise.

    For this shell alone: eval "$(flexcal completion bash)", or zsh, or flexcal completion fish | source.
    """

    shell: Annotated[Positional[Literal["bash", "zsh", "fish"]], arg(help="which shell")]
    out: Annotated[MaybePath, arg(metavar="FILE", help_behavior_hint="(default: standard output)")] = None
    """The file to write it to."""
    json: Json = False

    def run(self) -> None:
        """Print or write the script."""
        from flexcal.cli.arguments.completion_scripts import completion_script
        from flexcal.files.transaction import write_text

        console = Console(self.json)
        script = completion_script(self.shell)
        document = {"shell": self.shell, "script": script, "out": self.out}
        if self.out is not None:
            write_text(self.out, script)
            console.say(f"wrote {self.out}")
            console.finish(document, f"begin a new {self.shell}, which finds it as {_INSTALLED[self.shell]}")
        elif self.json:
            console.finish(document, f"put the script into {_INSTALLED[self.shell]}")
        else:
            console.say(script.rstrip("\n"))
