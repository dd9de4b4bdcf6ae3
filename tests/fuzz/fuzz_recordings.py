"""Ways to break recordings: universal files, bags of ROS 1, and the storages and messages of ROS 2."""

from __future__ import annotations

import sqlite3
import struct
import tempfile
from contextlib import closing
from functools import partial
from pathlib import Path

from fuzz_mutations import ESCAPE, NUMBERS, ODD_TEXTS, SCRIPT, Ways

_COUNTS = {
    "zero": 0,
    "one": 1,
    "many": 10**6,
    "int31": 2**31 - 1,
    "minus": 2**32 - 1,
}
_SQL = {
    "no_messages": "DELETE FROM messages",
    "no_topics": "DELETE FROM topics",
    "no_joint_states": "UPDATE topics SET type = 'std_msgs/msg/String'",
    "unknown_type": "UPDATE topics SET type = 'ours/msg/Unknown'",
    "type_without_package": "UPDATE topics SET type = 'JointState'",
    "type_number": "UPDATE topics SET type = 17",
    "type_null": "PRAGMA writable_schema = ON; UPDATE topics SET type = NULL",
    "type_script": f"UPDATE topics SET type = '{SCRIPT}{ESCAPE}'",
    "name_script": f"UPDATE topics SET name = '{SCRIPT}{ESCAPE}'",
    "name_blob": "UPDATE topics SET name = x'fffe00'",
    "name_bytes": "UPDATE topics SET name = CAST(x'2fff' AS TEXT)",
    "other_format": "UPDATE topics SET serialization_format = 'json'",
    "qos_text": "UPDATE topics SET offered_qos_profiles = 'none'",
    "qos_deep": f"UPDATE topics SET offered_qos_profiles = '{'[' * 100_000}'",
    "topic_unknown": "UPDATE messages SET topic_id = 99",
    "time_zero": "UPDATE messages SET timestamp = 0",
    "time_text": "UPDATE messages SET timestamp = 'now'",
    "time_null": "UPDATE messages SET timestamp = NULL",
    "time_minus": "UPDATE messages SET timestamp = -timestamp",
    "time_int64": "UPDATE messages SET timestamp = 9223372036854775807",
    "time_real": "UPDATE messages SET timestamp = 1e308",
    "data_null": "UPDATE messages SET data = NULL",
    "data_empty": "UPDATE messages SET data = x''",
    "data_text": "UPDATE messages SET data = 'text'",
    "data_number": "UPDATE messages SET data = 3",
    "data_cut": "UPDATE messages SET data = substr(data, 1, 30)",
    "one_cut": "UPDATE messages SET data = substr(data, 1, 50) WHERE id = 7",
    "data_longer": "UPDATE messages SET data = CAST(data || x'0000' AS BLOB)",
    "no_table_messages": "DROP TABLE messages",
    "no_table_topics": "DROP TABLE topics",
    "no_definitions": "DELETE FROM message_definitions",
    "definition_deep": f"UPDATE message_definitions SET encoded_message_definition = '{'A a' * 10_000}'",
    "definition_empty": "UPDATE message_definitions SET encoded_message_definition = ''",
    "definition_itself": "UPDATE message_definitions SET encoded_message_definition = 'JointState itself'",
    "definition_other": "UPDATE message_definitions SET encoded_message_definition = 'float64[] position'",
    "definition_encoding": "UPDATE message_definitions SET encoding = 'unknown'",
    "schema": "UPDATE schema SET schema_version = 99",
    "schema_text": "UPDATE schema SET schema_version = 'x'",
    "no_schema": "DROP TABLE schema",
    "column_gone": "ALTER TABLE messages DROP COLUMN data",
    "all_messages_one_time": "UPDATE messages SET timestamp = 5",
    "reversed": "UPDATE messages SET timestamp = 9e9 - timestamp",
}


def by_names(content: bytes) -> Ways:
    """The names in a recording replaced by others of the same length, so that all that counts letters stays true."""
    for name in (
        b"/joint_states",
        b"sensor_msgs/msg/JointState",
        b"sensor_msgs/JointState",
        b"axis_1",
        b"position",
    ):
        if name not in content:
            continue
        others = {
            "bytes": b"\xff\xfe",
            "zeros": b"\0",
            "escape": ESCAPE.encode(),
            "script": SCRIPT.encode(),
            "surrogate": b"\xed\xa0\x80",
            "same": b"axis_2",
            "letters": b"x",
        }
        for label, other in others.items():
            changed = (other * len(name))[: len(name)]
            yield f"{_word(name)}_{label}", partial(content.replace, name, changed)
            yield f"{_word(name)}_{label}_once", partial(content.replace, name, changed, 1)
            at = content.rindex(name)
            yield f"{_word(name)}_{label}_last", partial(_put, content, at, changed)


def by_counts(content: bytes) -> Ways:
    """Whole numbers of four and eight bytes in the first and the last thousand bytes and between, replaced by other ones."""
    ends = [
        *range(0, min(1000, len(content) - 8), 12),
        *range(max(0, len(content) - 1000), len(content) - 8, 36),
    ]
    for at in [*ends, *range(1000, len(content) - 1008, max(1, len(content) // 12))]:
        for label, count in _COUNTS.items():
            yield f"count_{at}_{label}", partial(_put, content, at, struct.pack("<I", count))
        for label, count in (("int63", 2**63 - 1), ("tera", 2**40), ("minus_8", 2**64 - 1)):
            yield f"count_{at}_{label}", partial(_put, content, at, struct.pack("<Q", count))


def by_values(content: bytes) -> Ways:
    """Numbers of eight bytes along the file replaced by such as no joint has."""
    odd = {"nan": float("nan"), "infinite": float("inf"), "huge": 1e308, "tiny": 5e-324}
    for share in range(1, 10):
        at = share * len(content) // 10
        for label, value in odd.items():
            packed = struct.pack("<d", value)
            yield f"value_{share}_{label}", partial(_put, content, at, packed)
            yield f"values_{share}_{label}", partial(_put, content, at, 30 * packed)


def by_statements(content: bytes) -> Ways:
    """A storage of SQLite after a statement: other topics, times and messages, and tables that are missing."""
    for label, statement in _SQL.items():
        yield label, partial(_changed, content, statement)


def by_universal_fields(content: bytes) -> Ways:
    """The fields of the first data set of a universal file, one by one, its lines, and the ends of all data sets."""
    lines = content.split(b"\n")
    texts = {**NUMBERS, "minus_one": "-1", "word": "abc", "empty": " ", "many": "99999999", **ODD_TEXTS}
    for row, line in enumerate(lines[:16]):
        before, after = lines[:row], lines[row + 1 :]
        for column, field in enumerate(line.split()):
            for label, text in texts.items():
                changed = line.replace(field, text.encode().ljust(len(field)), 1)
                yield f"line_{row}_field_{column}_{label}", partial(b"\n".join, [*before, changed, *after])
        yield f"line_{row}_gone", partial(b"\n".join, [*before, *after])
        yield f"line_{row}_twice", partial(b"\n".join, [*before, line, line, *after])
        yield f"line_{row}_long", lambda b=before, m=line, a=after: b"\n".join([*b, m + b"9" * 1_000_000, *a])
        yield f"line_{row}_blank", partial(b"\n".join, [*before, b"", *after])
    end = b"    -1\n"
    yield "last_end_gone", partial(content.removesuffix, end)
    yield "first_end_gone", lambda: end + content.removeprefix(end).replace(end, b"", 1)
    yield "only_ends", lambda: 8 * end
    middle = len(content) // 2
    yield "an_end_inside", lambda: content[:middle] + b"\n" + 2 * end + content[middle:]
    for kind in ("15", "55", "58b", "82", "151", "164", "2411", "2412", "2414", "2420", "17", "-58"):
        yield f"all_of_kind_{kind}", partial(content.replace, end + b"    58", end + kind.rjust(6).encode())


def _word(name: bytes) -> str:
    return name.decode().strip("/").replace("/", "_")


def _put(content: bytes, at: int, new: bytes) -> bytes:
    return content[:at] + new + content[at + len(new) :]


def _changed(content: bytes, statement: str) -> bytes:
    """A file of SQLite after a statement."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "changed"
        path.write_bytes(content)
        with closing(sqlite3.connect(path)) as base:
            try:
                base.executescript(statement)
            except sqlite3.Error:  # what the storage itself forbids cannot be in one
                base.rollback()
            base.commit()
        return path.read_bytes()
