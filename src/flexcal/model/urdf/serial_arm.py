"""Serial arm of a URDF: its joints, locked joints and tool frame, from the tree of links."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import InputError
from flexcal.files.structuring import suggestion
from flexcal.files.transaction import current_path
from flexcal.model.urdf.checks import carried_links
from flexcal.model.urdf.elements import Element, read_elements, xacro_error

_GRIPPER = re.compile(
    r"gripper|finger|knuckle|jaw|thumb|(?<![a-z])(hand|claw|suction|vacuum)(?![a-z])", re.IGNORECASE
)
_TOOL_FRAMES = ("tool0", "tcp", "flange", "tool", "end_effector", "ee_link", "ee", "hand")
"""Link names to which tools and reflectors are fixed, the most usual first."""
_FEW = 2
"""Largest number of joints of a branch that does not count as an arm beside one with more than twice as many."""


class AmbiguousArm(InputError):
    """A URDF in which the end of the arm has to be chosen."""


@dataclass(frozen=True)
class Arm:
    """Chain of a URDF that moves its tool.

    joints: names of its movable joints, from the base on. locked: the other movable joints and where they stand (rad or m): 0, or the
    nearest limit. motors: where a joint beside the chain is mimicked by one of it, the joints with motors, in the order of their names,
    which is a guess. frame: the link that a point is most likely given in; frames: the links that do not move against it, that one first.
    """

    joints: tuple[str, ...]
    locked: dict[str, float]
    motors: tuple[str, ...]
    frame: str
    frames: tuple[str, ...]


def find_arm(path: Path, tip: str | None = None) -> Arm:
    """Arm of a URDF: the only long chain, or the chain that ends at the link `tip`.

    Joints that mimic others beyond the arm, are called like a gripper's, or make a short branch beside the one long one, are no part of
    it; joints that those on the way to the tool mimic are not locked. Raises `InputError` as `read_urdf` does, where several chains could
    be the arm, and where `tip` is no link or moves with no joint.
    """
    if path.suffix == ".xacro":
        raise xacro_error(path)
    if path.is_dir():
        raise InputError("E-URDF-034", f"{path} is a folder; name the robot's URDF in it.")
    if not current_path(path).is_file():
        raise InputError("E-URDF-035", f"{path}: there is no such file; name the robot's URDF.")
    root = read_elements(path)
    joints = {joint.attributes.get("name", ""): joint for joint in root.all("joint")}
    mimics = {name for name, joint in joints.items() if joint.find("mimic") is not None}
    carried = carried_links(root, mimics)
    movable = [name for name in carried if joints[name].attributes["type"] != "fixed"]
    if not movable:
        raise InputError("E-URDF-036", f"{path}: the URDF has no movable joint; a robot needs at least one.")
    above = {link: name for name, link in carried.items()}
    ways = {link: _way(link, above, joints) for link in above}
    if tip is None:
        alike = {name for name in movable if name in mimics or _GRIPPER.search(name)}
        beyond = {
            name: {n for way in ways.values() if name in way for n in way[way.index(name) :]}
            for name in alike
        }
        beside = {name for name in alike if beyond[name] & set(movable) <= alike}
        chain = _only_chain(
            path, {link: [n for n in way if n in movable] for link, way in ways.items()}, beside, ways
        )
    else:
        if tip not in ways:
            near = suggestion(tip, list(ways)) or f"; the links are {', '.join(ways)}."
            raise InputError("E-URDF-037", f"{path}: there is no link '{tip}' beyond a joint{near}")
        chain = tuple(name for name in ways[tip] if name in movable)
        if not chain:
            raise InputError(
                "E-URDF-038", f"{path}: the link '{tip}' moves with no joint; name one beyond the arm."
            )
    moving = _with_mimicked(chain, joints)
    frames = [link for link in ways if tuple(n for n in ways[link] if n in movable) == chain and link != tip]
    ordered = ([] if tip is None else [tip]) + sorted(frames, key=lambda link: _rank(link, ways))
    locked = {name: _at_rest(joints[name]) for name in movable if name not in moving}
    driven = sorted(moving - mimics, key=_natural) if moving - set(chain) else []
    return Arm(chain, locked, tuple(driven), ordered[0], tuple(ordered))


def _with_mimicked(chain: Sequence[str], joints: Mapping[str, Element]) -> set[str]:
    """Joints of a chain with those that they mimic."""
    moving, waiting = set(chain), list(chain)
    while waiting:
        mimic = joints[waiting.pop()].find("mimic")
        other = "" if mimic is None else mimic.attributes.get("joint", "")
        if other in joints and other not in moving:
            moving.add(other)
            waiting.append(other)
    return moving


def _natural(name: str) -> list[tuple[bool, int, str]]:
    """Sort key of names in which numbers count as numbers."""
    parts = re.split(r"([0-9]{1,18})", name)
    return [(k % 2 == 1, int(part) if k % 2 else 0, part) for k, part in enumerate(parts)]


def _way(link: str, above: dict[str, str], joints: dict[str, Element]) -> tuple[str, ...]:
    """Joints from the base to a link."""
    way: list[str] = []
    while link in above:
        way.append(above[link])
        parent = joints[above[link]].find("parent")
        assert parent is not None
        link = parent.attributes["link"]
    return tuple(reversed(way))


def _only_chain(
    path: Path, moving: Mapping[str, Sequence[str]], beside: set[str], ways: dict[str, tuple[str, ...]]
) -> tuple[str, ...]:
    """The single long chain to one of the links `moving`, without those `beside` it; raises `InputError` that lists several tips."""
    ends: dict[tuple[str, ...], str] = {}
    for link in sorted(moving, key=lambda link: _rank(link, ways), reverse=True):
        ends[tuple(name for name in moving[link] if name not in beside)] = link
    ends.pop((), None)
    longest = {c: link for c, link in ends.items() if not any(c == o[: len(c)] and c != o for o in ends)}
    if not longest:
        raise AmbiguousArm(
            "E-URDF-040",
            f"{path}: every movable joint looks like a gripper's ({', '.join(sorted(beside))}); say where the arm ends with --tip LINK.",
        )
    most = max(len(chain) for chain in longest)
    arms = [chain for chain in longest if len(chain) > _FEW or most <= 2 * _FEW]
    if len(arms) > 1:
        listed = ", ".join(f"{longest[chain]} ({len(chain)} joints)" for chain in arms)
        raise AmbiguousArm(
            "E-URDF-041",
            f"{path}: the URDF has several chains; say which is the arm, as --tip LINK: {listed}.",
        )
    return arms[0]


def _rank(link: str, ways: dict[str, tuple[str, ...]]) -> tuple[int, bool, int]:
    """Sort key of tool frames: usual names first, a gripper's last, then the farthest from the base."""
    name = f"_{link.lower()}_".replace("-", "_")
    usual_names = [i for i, usual in enumerate(_TOOL_FRAMES) if f"_{usual}_" in name]
    return (
        usual_names[0] if usual_names else len(_TOOL_FRAMES),
        bool(_GRIPPER.search(link)),
        -len(ways[link]),
    )


def _at_rest(joint: Element) -> float:
    limit = joint.find("limit")
    if joint.attributes["type"] == "continuous" or limit is None:
        return 0.0
    lower, upper = float(limit.attributes["lower"]), float(limit.attributes["upper"])
    return min(max(0.0, lower), upper)
