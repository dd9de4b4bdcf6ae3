"""Values change in a YAML text, and nothing else does."""

from __future__ import annotations

import difflib
from pathlib import Path

import numpy as np
import pytest
from refusals import refused

from flexcal.files.formats import REMOVED, edited_yaml
from flexcal.files.formats.yaml_document import parse_document

EXAMPLES = sorted((Path(__file__).parent.parent / "examples").glob("*/*.yaml"))

HOSTILE = {
    "crlf": (
        "# über\r\nrobot: a.urdf\r\npoints:\r\n  smr: {frame: t, xyz: [0,0,1]}   # c\r\n  # after\r\n\r\n"
        "payload:\t# tab\r\n  mass: 1\r\n"
    ),
    "quoted": (
        'robot: \'a.urdf\'\n"points":\n    \'smr\':\n        "frame": "t"\n        xyz:\n        - 0\n        - 0.10 # ten\n'
        "        - +1\npayload: {'mass':   1 , \"com\": [0, 0, 0]}\n"
    ),
    "flow over lines": (
        "robot: a.urdf\npoints: { # all\n  smr: {frame: t,   # here\n    xyz: [0,  0, # low\n      1.0e-3]},\n"
        "  b: {frame: t, xyz: [0, 0, 0]},\n  }\npayload:\n    mass: 1 # kg\n    # end\n"
    ),
    "utf-8": (
        "\ufeffrobot: ä.urdf\npoints: {smr: {frame: 'Flansch_ß', xyz: [0, 0, 1]}}   # Spiegel 🪞\npayload: {mass: 1}"
    ),
    "no last line end": "robot: a.urdf\npayload:\n  mass: 1\npoints:\n  smr:\n    frame: t\n    xyz: [0, 0, 1]",
}


def data(text: str):
    return parse_document(Path("x"), text.removeprefix("\ufeff"))[0]


def kept(before: str, after: str) -> str:
    """Characters of `before` that are missing in `after`."""
    matcher = difflib.SequenceMatcher(None, before, after, autojunk=False)
    return "".join(before[i1:i2] for tag, i1, i2, _, _ in matcher.get_opcodes() if tag != "equal")


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_a_value_changes_and_its_surroundings_do_not(text: str) -> None:
    changed = edited_yaml(text, ("payload", "mass"), 2.5)
    at = next(i for i, (a, b) in enumerate(zip(text, changed, strict=False)) if a != b)
    assert changed == text[:at] + "2.5" + text[at + 1 :] and text[at] == "1"
    assert data(changed) == data(text) | {"payload": data(text)["payload"] | {"mass": 2.5}}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_a_list_changes_and_comments_within_it_stay(text: str) -> None:
    changed = edited_yaml(text, ("points", "smr", "xyz"), (0.25, -3e-7, 7.0))
    assert data(changed)["points"]["smr"]["xyz"] == [0.25, -3e-7, 7.0]
    for word in ("# c", "# ten", "# low", "# here", "# after", "🪞", "# all", "\ufeff"):
        assert (word in text) == (word in changed)
    assert text.count("\r\n") == changed.count("\r\n") and changed.count("\n") == text.count("\n")
    assert not set(kept(text, changed)) - set("0123456789.e+-, ")


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_what_is_added_is_all_that_is_new_and_goes_again(text: str) -> None:
    """Adding a block, a point and a key leaves every character; removing them gives the text back."""
    for keys, value in [
        (("points", "second one"), {"frame": "tool: 0", "xyz": [0.0, 0.5, 1]}),
        (("payload", "frame"), "t"),
        (("stations", "tracker", "xyz"), [1.0, 2.0, 3.0]),
    ]:
        changed = edited_yaml(text, keys, value)
        assert kept(text, changed) == "" and len(changed) > len(text)
        expected = data(text)
        inner = expected
        for key in keys[:-1]:
            inner = inner.setdefault(key, {})
        inner[keys[-1]] = value
        assert data(changed) == expected
        assert ("\n" in changed.replace("\r\n", "")) == ("\n" in text.replace("\r\n", ""))
        back = edited_yaml(changed, keys[:2] if keys[0] != "stations" else keys[:1], REMOVED)
        assert back.rstrip("\n") == text.rstrip("\n")


@pytest.mark.parametrize("path", EXAMPLES, ids=[f"{p.parent.name}/{p.name}" for p in EXAMPLES])
def test_every_number_of_the_examples_can_be_changed_alone(path: Path) -> None:
    text = path.read_bytes().decode()
    before, lines = parse_document(path, text)
    numbers = 0
    for keys in lines:
        value = before
        for key in keys:
            value = value[key]
        if isinstance(value, float):
            changed = edited_yaml(text, keys, value + 1.0)
            # one line differs, and only within the number
            old, new = text.splitlines(), changed.splitlines()
            (number,) = [i for i, (a, b) in enumerate(zip(old, new, strict=True)) if a != b]
            assert number == lines[keys] - 1
            numbers += 1
            if numbers == 25:
                break
    assert numbers or path.name != "robot.yaml"


def test_removal() -> None:
    text = "a: 1\nb: # x\n  c: {d: 1, e: 2, f: 3} # y\n  g:\n  - 1\n# z\nh: 4"
    assert edited_yaml(text, ("b", "c", "d"), REMOVED) == text.replace("d: 1, ", "")
    assert edited_yaml(text, ("b", "c", "e"), REMOVED) == text.replace(", e: 2", "")
    assert edited_yaml(text, ("b", "c", "f"), REMOVED) == text.replace(", f: 3", "")
    assert edited_yaml(text, ("b", "g"), REMOVED) == text.replace("  g:\n  - 1\n", "")
    assert edited_yaml(text, ("b",), REMOVED) == "a: 1\n# z\nh: 4"
    assert data(edited_yaml(text, ("h",), REMOVED)) == {"a": 1, "b": data(text)["b"]}
    assert edited_yaml(text, ("b", "c"), {"e": 5, "new": None}) == text.replace(
        "{d: 1, e: 2, f: 3}", "{e: 5, new: null}"
    )


def test_anything_written_is_read_back_the_same(rng: np.random.Generator) -> None:
    letters = list("abcd01.-+eE_:#'\"{}[]&*!|>%@`, \t\\~äß🪞?")
    for _ in range(400):
        word = "".join(rng.choice(letters, rng.integers(0, 7)))
        for value in (word, [word, 1.5], {word: word}, float(rng.normal() * 10.0 ** rng.integers(-20, 20))):
            for text in ("a: 1\nb: {c: 2}\n", "a:\nb: {}\n"):
                assert data(edited_yaml(text, ("a",), value))["a"] == value
                assert data(edited_yaml(text, ("b", "new"), value))["b"]["new"] == value


def test_what_cannot_be_changed_alone_is_refused() -> None:
    shared = "a: &x [1, 2]\nb: *x\nc: {d: 1}\n"
    assert edited_yaml(shared, ("c", "d"), 2) == shared.replace("d: 1", "d: 2")
    with refused("E-YAML-035", "a[0]"):
        edited_yaml(shared, ("a", 0), 3)
    with refused("E-YAML-035", "a"):
        edited_yaml(shared, ("a",), [3])
    with refused("E-YAML-037", "c.d.e"):
        edited_yaml(shared, ("c", "d", "e"), 3)
    with refused("E-YAML-037", "a[2]"):
        edited_yaml(shared, ("a", 2), 3)
    with refused("E-YAML-036", "c.e"):
        edited_yaml(shared, ("c", "e"), REMOVED)
    with refused("E-YAML-038"):
        edited_yaml(shared, ("c", "d"), float("nan"))
    with refused("E-YAML-014", "d"):
        edited_yaml("a: 1\nd: 1\nd: 2\n", ("a",), 2)
