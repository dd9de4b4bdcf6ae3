"""One property of every command line: it ends with 0, or 2 and a sentence, in bounded time and memory, and changes only --out."""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import shutil
import stat
from collections import Counter
from collections.abc import Sequence
from fnmatch import fnmatchcase
from pathlib import Path

from fuzz_cases import Case, case_of, files_named, named_case
from fuzz_surroundings import INTRUSIONS, KINDS, write_home
from fuzz_worker import Ending, carry_out

from flexcal.cli.arguments.verb_table import find_verb

SECONDS = 10.0
"""Of processor time a case."""
MEGABYTES = 700.0
"""Of memory a case, of which 200 are the program."""
CANARY = "canary-7f3a"
_CONTROL = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")
_OF_THE_ROBOT = ("[E-MODEL-007]",)
"""Sentences that name the robot instead of a file: what is wrong follows from several files together."""
_AFTER_A_LOOK = "[E-CLI-035]\n"
"""Refusal after the sentences on how a file was read."""
_REMARK = re.compile(" …$|^(Pinocchio|OpenCV): |^note: .* left by a run that was cut off")
"""Of progress, what a native library says, on one line, and left-overs, which are named and stay."""
Tree = dict[str, tuple[object, ...]]


def tree(root: Path) -> Tree:
    """Kind and permissions of all below a folder by its path; of files the size and hash, of links the target."""
    found: Tree = {}
    for above, folders, files in os.walk(root):
        for name in (*folders, *files):
            path = os.path.join(above, name)
            status = os.lstat(path)
            what: tuple[object, ...] = (stat.filemode(status.st_mode),)
            if stat.S_ISLNK(status.st_mode):
                what += (os.readlink(path),)
            elif stat.S_ISREG(status.st_mode):
                what += (status.st_size,)
                if status.st_size < 10**9:
                    with open(path, "rb") as file:
                        what += (hashlib.file_digest(file, "blake2b").hexdigest(),)
            found[os.path.relpath(path, root)] = what
    return found


def fault_of(
    ending: Ending, files: list[str] | None, *, serves: bool = False, partly: bool = False
) -> str | None:
    """What is wrong with how a command line ended, None where nothing is; a refusal has to mention one of `files`, where given."""
    out, err = ending.out, ending.err
    if ending.late:
        return f"no end after {ending.seconds:.0f} s of processor time\n{err[-1000:]}"
    if ending.status < 0:
        return f"ended by signal {-ending.status}\n{err[-3000:]}"
    if "Traceback (most recent call last)" in err or ending.status not in ((0, 2, 130) if serves else (0, 2)):
        return f"exit status {ending.status}\n{err[-4000:]}"
    if odd := _CONTROL.findall(out + err):
        return f"control characters reach the terminal: {odd[:5]}\n{(out + err)[-500:]!r}"
    if ending.orphans:
        return "processes outlive it"
    if ending.seconds > SECONDS:
        return f"{ending.seconds:.1f} s of processor time\n{err[-1000:]}"
    if ending.megabytes > MEGABYTES:
        return f"{ending.megabytes:.0f} MB\n{err[-1000:]}"
    if "Warning: " in err:
        return f"a warning of a library\n{err[-3000:]}"
    if ending.status != 2:
        return None
    lines = [line for line in err.splitlines() if not _REMARK.search(line)]
    partly = partly or err.endswith(_AFTER_A_LOOK)
    if len(lines[-1:] if partly else lines) != 1 or not lines[-1].startswith("flexcal: "):
        return f"not one sentence\n{err[-3000:]}"
    if len(lines[-1]) > 1200:
        return f"a sentence of {len(lines[-1])} letters: {lines[-1][:300]} …"
    if "[E-CLI-016]" in lines[-1]:
        return f"memory is exhausted: {lines[-1]}"
    return (
        None
        if files is None or any(name in lines[-1] for name in (*files, *_OF_THE_ROBOT))
        else f"no file is named: {lines[-1]}"
    )


def changes(
    before: Tree, after: Tree, own: Sequence[str], over: Sequence[str] = ()
) -> tuple[list[str], list[str], list[str]]:
    """What came elsewhere than at its `own` places, what was changed or removed but those written `over`, and what came at its own.

    Places are patterns of paths in the folder `work`.
    """

    def among(name: str, patterns: Sequence[str]) -> bool:
        return any(fnmatchcase(name, f"work/{pattern}") for pattern in patterns)

    new = sorted(name for name in after if name not in before)
    changed = sorted(name for name in before if after.get(name) != before[name] and not among(name, over))
    return [n for n in new if not among(n, own)], changed, [n for n in new if among(n, own)]


def _own_places(case: Case) -> tuple[list[str], list[str]]:
    """Where a case may write: --out and what belongs to it; and where it may write over."""
    words, own, over = case.words(), [*case.line.writes], [*case.line.writes]
    verb = find_verb(words)
    assert verb is not None
    for out in [Path(words[k + 1]) for k, word in enumerate(words) if word == "--out"]:
        own += [str(out), f"{out}/*", *(f"{out.stem}{ending}" for ending in verb.beside)]
        own += [f"{out.stem}.html"] if verb.page else []
        record = f"{out}/.flexcal" if verb.leaves else ".flexcal"
        own.append(record)
        over.append(record)
    return own, over


class Room:
    """A folder with the valid files in `work`, a home that nothing may touch beside it, and one case after the other in them."""

    def __init__(self, seeds: Path, folder: Path) -> None:
        self.seeds, self.folder, self.work = seeds, folder, folder / "work"
        self.told = ""
        self.statuses: Counter[int] = Counter()
        self.seconds: list[tuple[float, str]] = []
        self.megabytes: list[tuple[float, str]] = []
        self._clean()

    def _clean(self) -> None:
        if self.folder.exists():
            shutil.rmtree(self.folder)
        write_home(self.folder / "home")
        (self.folder / "tmp").mkdir()
        shutil.copytree(self.seeds, self.work)
        self.valid = tree(self.folder)

    def fault(self, which: int | list[str], *, keep: bool = False) -> str | None:
        """Carry out a case, by its number or by file, label and command line: what is wrong, None where nothing is."""
        case = (
            case_of(which, self.seeds)
            if isinstance(which, int)
            else named_case(which[0], which[1], which[2], self.seeds)
        )
        self._lay_out(case)
        before = tree(self.folder)
        ending = carry_out(
            case.words(), str(self.work), serves=case.line.serves, home=str(self.folder / "home")
        )
        after = tree(self.folder)
        named = None if case.names or case.line.partly else files_named(case)
        kind = {"serves": case.line.serves, "partly": case.line.partly}
        fault = fault_of(ending, named, **kind) or self._trace(case, before, after, ending)
        line = f"flexcal {shlex.join(case.words())}"
        figures = f"exit status {ending.status}, {ending.seconds:.2f} s, {ending.megabytes:.0f} MB"
        self.told = f"case {case.name}: {line}\n  {case.said}\n  {figures}\n{ending.err[-1500:]}"
        self.statuses[ending.status] += 1
        self.seconds.append((ending.seconds, f"{case.name} {line}"))
        self.megabytes.append((ending.megabytes, f"{case.name} {line}"))
        if not keep:
            self._restore(after)
        return fault and f"case {case.name}: {line}\n  {case.said}\n  {fault}"

    def _lay_out(self, case: Case) -> None:
        for file, content in case.contents.items():
            (self.work / file).write_bytes(content)
        if case.kind is not None:
            file, kind = case.kind
            (self.work / file).unlink()
            KINDS[kind](self.work / file)
        for file, name in case.names.items():
            if os.path.lexists(self.work / file):
                (self.work / file).rename(self.work / name)
        for place, what in case.intrusions:
            (self.work / place).mkdir(exist_ok=True)
            try:
                INTRUSIONS[what](self.work / place)
            except FileExistsError:  # twice the same
                continue

    def _restore(self, now: Tree) -> None:
        """Take away what a case has left, and put back what it has broken."""
        different = {name for name in {*now, *self.valid} if now.get(name) != self.valid.get(name)}
        for name in sorted(different, key=len):
            path = self.folder / name
            if path.is_symlink() or not path.is_dir():
                path.unlink(missing_ok=True)
            elif not str(self.valid.get(name, "-")[0]).startswith("d"):
                shutil.rmtree(path)
        for name in sorted(different & {*self.valid}, key=len):
            if not name.startswith("work/"):
                return self._clean()
            source = self.seeds / name.removeprefix("work/")
            if source.is_dir():
                (self.folder / name).mkdir(exist_ok=True)
            else:
                shutil.copy2(source, self.folder / name)
        return None

    def _trace(self, case: Case, before: Tree, after: Tree, ending: Ending) -> str | None:
        """What is changed that may not be, or is left behind."""
        own, over = _own_places(case)
        added, changed, left = changes(before, after, own, over)
        said = f"after exit status {ending.status}\n{ending.err[-500:]}"
        if added or changed:
            return f"writes {added[:5]}, changes or removes {changed[:5]} {said}"
        if case.line.serves:
            return None
        if (ending.status and left and not case.line.partly) or any(
            "/." in name.replace("/.flexcal", "") for name in left
        ):
            return f"leaves {left[:5]} {said}"
        if case.kind is not None and case.kind[1] == "secret":
            return None
        if CANARY in ending.out + ending.err:
            return "the content of a file outside is printed"
        for path in (self.folder / name for name in left):
            if path.is_file() and not path.is_symlink() and CANARY.encode() in path.read_bytes():
                return f"the content of a file outside is in {path.name}"
        return None

    def report(self) -> None:
        """Print how the cases ended, and the slowest and largest."""
        total = sum(seconds for seconds, _ in self.seconds)
        print(f"exit statuses {dict(self.statuses)}, {total:.0f} s of processor time")
        for name, values in (("s", self.seconds), ("MB", self.megabytes)):
            for value, line in sorted(values, reverse=True)[:8]:
                print(f"  {value:.1f} {name} {line}")
