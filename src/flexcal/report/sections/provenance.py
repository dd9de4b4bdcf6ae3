"""Provenance of the numbers, and the command that reproduces them."""

from __future__ import annotations

from collections.abc import Mapping

from flexcal import __version__
from flexcal.estimation import Estimate
from flexcal.files.formats import Block
from flexcal.report.layout import Block as PageBlock
from flexcal.report.layout import Section, Table, Text

_MANY = 20
"""Number of input files from which they have a folded table of their own: an experiment of several poses has hundreds."""


def provenance_section(
    command: str, seed: int | None, seconds: Mapping[str, float], origin: Mapping[str, str]
) -> Section:
    """Program version, seed, inputs with their hashes, the command, and how long each stage took."""
    rows = [] if "program" in origin else [("program", f"flexcal {__version__}")]
    rows += [("command", command)] if command else []
    rows += [("seed of all random numbers", str(seed))] if seed is not None else []
    files = [(name, value) for name, value in origin.items() if name.startswith("input.")]
    many = files if len(files) > _MANY else []
    rows += [(name, value) for name, value in origin.items() if (name, value) not in many]
    blocks: list[PageBlock] = [
        Table("table-provenance", "What made this report", ("what", "value"), tuple(rows), text_columns=(1,))
    ]
    if many:
        caption, columns = f"The {len(many)} files that it was made from", ("file", "SHA-256")
        named = tuple((name.removeprefix("input."), value) for name, value in many)
        blocks.append(Table("table-inputs", caption, columns, named, text_columns=(1,), folded=True))
    if seconds:
        spent = {name: value for name, value in seconds.items() if value > 0}
        spent |= {"total": sum(spent.values())} if "total" not in spent else {}
        times = tuple((name, f"{value:.1f} s") for name, value in spent.items())
        strong = tuple(k for k, (name, _) in enumerate(times) if name == "total")
        blocks.append(
            Table("table-seconds", "How long each stage took", ("stage", "time"), times, strong=strong)
        )
    if command:
        blocks.append(
            Text(
                (
                    "The command counts from the folder where it was given. With the same files (sha256sum tells) and the same program it "
                    "gives the same numbers; only the durations differ.",
                )
            )
        )
    return Section("provenance", "Provenance", "", tuple(blocks))


def input_files(origin: Mapping[str, str]) -> dict[str, str]:
    """Name and SHA-256 of every file that results were made from."""
    return {name.removeprefix("input."): value for name, value in origin.items() if name.startswith("input.")}


def common_origin(estimates: Mapping[Block, Estimate]) -> dict[str, str]:
    """Common provenance of all blocks; different values of a key stand under their blocks' names."""
    origin: dict[str, str] = {}
    for block, estimate in estimates.items():
        for key, value in estimate.provenance.items():
            shown = key if origin.get(key, value) == value else f"{key} ({block})"
            origin[shown] = value
    return origin
