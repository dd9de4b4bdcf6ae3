"""Stiffness and damping with intervals, beside true and published values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from flexcal.estimation import Estimate
from flexcal.report.layout import NOTHING, Table, interval_words, percent, scaled, significant, spring_label


def spring_table(
    estimate: Estimate,
    names: Sequence[str],
    kind: str,
    truth: Mapping[str, float] | None,
    published: Mapping[str, float],
    source: str,
) -> Table:
    """Every stiffness or damping; columns of truth and publication only where there is any."""
    factor, unit = scaled("N m/rad" if kind == "stiffness" else "N m s/rad")
    with_published = any(name in published for name in names)
    columns = ["spring", f"estimate ({unit})", "95 % interval", "std"]
    columns += ["truth", "difference", "truth in interval"] if truth is not None else []
    columns += [source] if with_published else []
    rows = tuple(_row(estimate, name, factor, truth, published if with_published else None) for name in names)
    note = (
        "Published values are for orientation only: they belong to another robot of the same type."
        if with_published
        else ""
    )
    return Table(
        id=f"table-{kind}",
        caption=f"{kind.capitalize()} of drives and bearings",
        columns=tuple(columns),
        rows=rows,
        note=note,
    )


def unseen_springs(estimate: Estimate, names: Sequence[str]) -> tuple[str, ...]:
    """A sentence for every stiffness and damping that the data do not determine."""
    return tuple(
        f"{spring_label(name)}, {name.rpartition('.')[2]}: {_reason(estimate, name)}"
        for name in names
        if estimate.interval(name) is None
    )


def hardening_sentence(estimate: Estimate) -> str:
    """Sentence on the estimated hardening of the drives; "" without an estimate."""
    names = [name for name in estimate.parameters.names if name.endswith(".drive.hardening")]
    if not names:
        return ""
    shares = (
        f"{name.split('.')[0]} {percent(estimate.values[name])} ({estimate.spread(name, 100.0)} %)"
        for name in names
    )
    return (
        "The drives harden under load: at a twist of 1 mrad the torque exceeds what the stiffness gives by "
        f"{', '.join(shares)}; ± is 1σ, a limit that of 95 %. The stiffness is that at no load; rest positions and responses are computed "
        "with both."
    )


def hysteresis_sentence(estimate: Estimate) -> str:
    """Sentence on the estimated hysteresis of the drives; "" without an estimate."""
    joints = [
        n.removesuffix(key) for n in estimate.parameters.names if n.endswith(key := ".drive.slip_share")
    ]
    if not joints:
        return ""
    widths = (
        f"{joint} {2e6 * estimate.values[f'{joint}.drive.slip_share'] * estimate.values[f'{joint}.drive.slip_twist']:.0f} µrad"
        for joint in joints
    )
    return (
        f"The drives have hysteresis, in loops of about {', '.join(widths)}. Under the small motion of the experiment they are stiffer "
        "than under changes of load, to which the stiffnesses here belong; their intervals contain what that leaves open, and how much "
        "the poses differ."
    )


def _row(
    estimate: Estimate,
    name: str,
    factor: float,
    truth: Mapping[str, float] | None,
    published: Mapping[str, float] | None,
) -> tuple[str | None, ...]:
    interval, value = estimate.interval(name), estimate.values[name]
    cells: list[str | None]
    if interval is None:
        cells = ["not determined by these data", None, None]
    else:
        std = estimate.std(name) or 0.0
        cells = [
            significant(factor * value),
            interval_words(estimate, name, lambda v: significant(factor * v)),
            percent(std / value),
        ]
    if truth is not None:
        known = truth.get(name)
        inside = interval is not None and known is not None and interval[0] <= known <= interval[1]
        cells.append(significant(None if known is None else factor * known))
        cells.append(
            NOTHING if interval is None or known is None else percent(value / known - 1, signed=True)
        )
        cells.append(NOTHING if interval is None or known is None else "yes" if inside else "no")
    if published is not None:
        published_value = published.get(name)
        cells.append(significant(None if published_value is None else factor * published_value))
    return (spring_label(name), *cells)


def _reason(estimate: Estimate, name: str) -> str:
    number = estimate.parameters.index(name)
    log_std = float(estimate.covariance[number, number]) ** 0.5
    dropped = next((d for d in estimate.dropped if d.name == name), None)
    if dropped is not None and dropped.absorbed_by:
        return f"the data do not distinguish it from {', '.join(n for n, _ in dropped.absorbed_by[:3])}."
    if dropped is not None or log_std == 0:
        return "the measured responses do not depend on it in these poses."
    return (
        f"the responses hardly depend on it in these poses: any value within a factor of {2.718281828 ** (1.96 * log_std):.0f} fits as "
        "well. Another pose, or a payload farther off the axis, would excite it."
    )
