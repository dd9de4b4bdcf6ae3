"""Rows of measured poses that are excluded: the column `excluded`, which holds the reason."""

from __future__ import annotations

from flexcal.data.tables import TableFile

EXCLUDED = "excluded"
_NO = ("0", "0.0", "false", "no")
_NAMED = 3
"""Number of excluded rows that a remark names."""


def without_excluded(file: TableFile) -> tuple[TableFile, tuple[str, ...]]:
    """A table without its excluded rows and the column that says so, and a remark on them; none where no row is excluded.

    Raises `InputError` where all rows are excluded, and for a 0 or a "no", which is no reason.
    """
    if EXCLUDED not in file.columns:
        return file, ()
    reasons = file.texts(EXCLUDED)
    file = file.leaving_out([EXCLUDED])
    for row, reason in enumerate(reasons):
        if reason.lower() in _NO:
            raise file.error(
                "E-POSES-079",
                f"{file.row_word} {file.first + row} has '{reason}' in the column '{EXCLUDED}', which holds reasons; leave it empty "
                "where the row is used.",
            )
    rows = [row for row, reason in enumerate(reasons) if reason]
    if not rows:
        return file, ()
    if len(rows) == len(reasons):
        raise file.error(
            "E-POSES-080",
            f"all {len(rows)} rows are excluded, the first for '{reasons[0]}'; empty the column '{EXCLUDED}' of those to be used.",
        )
    return file.skipping(rows), (_remark(file, reasons, rows),)


def _remark(file: TableFile, reasons: list[str], rows: list[int]) -> str:
    poses = file.texts("pose") if "pose" in file.columns else []
    named: dict[str, str] = {}
    for row in rows:
        number = poses[row].removesuffix(".0") if poses else ""
        named.setdefault(f"pose {number}" if number else f"{file.row_word} {file.first + row}", reasons[row])
    listed = [f"{name} '{reason}'" for name, reason in named.items()]
    more = f" and {len(listed) - _NAMED} more" if len(listed) > _NAMED else ""
    count = "1 row is" if len(rows) == 1 else f"{len(rows)} rows are"
    return f"{file.path.name}: {count} excluded: {', '.join(listed[:_NAMED])}{more}"
