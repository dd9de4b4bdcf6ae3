"""What an identification had from other robots of the model, in words and in results.json."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from flexcal.jobs.fleet_prior.pooled_values import PoolConflict, PooledValues
from flexcal.report.layout import listed
from flexcal.report.results import chance_in_words

_LISTED = 8


@dataclass(frozen=True, eq=False)
class PooledUse:
    """Pooled values of a kind, `what`, that an identification had from a `file`.

    `conflict` is the test whether the robot is one of those that they are from, None where its measurements do not tell. Values that do not
    fit the robot are `used` all the same where it cannot be identified without them. `unused` says why others are not used at all.
    """

    what: str
    file: str
    pooled: PooledValues | None
    conflict: PoolConflict | None = None
    used: bool = True
    unused: str = ""

    @property
    def contradicted(self) -> bool:
        """Whether the robot is none of the others."""
        return self.conflict is not None and self.conflict.contradicted

    @property
    def remarks(self) -> list[str]:
        """Sentences on it."""
        if self.pooled is None:
            return (
                [f"the {self.what} of other robots in {self.file} is not used: {self.unused}"]
                if self.unused
                else []
            )
        others = f"{len(self.pooled.robots)} other robots of the model ({self.file})"
        if self.contradicted:
            assert self.conflict is not None
            end = (
                f"identify its {self.what}, which then counts in place of the others'"
                if self.used
                else "so it was identified from these measurements alone"
            )
            return [
                f"the {self.what} of {others} does not fit this robot ({self.conflict.clause}): is it of another batch, or was it "
                f"repaired? {end[0].upper()}{end[1:]}"
            ]
        names = self.pooled.names
        named = listed(names, _LISTED)
        log = [
            s for s, scale in zip(self.pooled.std.tolist(), self.pooled.scales, strict=True) if scale == "log"
        ]
        known = (
            f", known to {' to '.join(dict.fromkeys(f'{100 * std:.2g}' for std in (min(log), max(log))))} % for a robot of the model"
            if log
            else ""
        )
        fits = (
            "these measurements do not tell whether it fits this robot"
            if self.conflict is None
            else f"nothing in these measurements contradicts it ({chance_in_words(self.conflict.probability)})"
        )
        return [f"the {self.what} of {others} is its prior{known}; {fits}: {named}"]

    def document(self) -> dict[str, Any]:
        """Block of results.json."""
        pooled, conflict = self.pooled, self.conflict
        return {
            "file": self.file,
            "robots": [] if pooled is None else list(pooled.robots),
            "parameters": [] if pooled is None else list(pooled.names),
            "used": self.used and pooled is not None,
            "conflict": None
            if conflict is None
            else {
                "probability": conflict.probability,
                "contradicted": conflict.contradicted,
                "shifts": dict(conflict.shifts),
            },
        }
