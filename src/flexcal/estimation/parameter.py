"""Named parameters with unit, bounds and prior."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from typing import Any, Literal

import numpy as np

from flexcal.errors import FlexcalError


@dataclass(frozen=True)
class Parameter:
    """Unknown of an estimation. Everything is in natural units except `prior_std`.

    `scale` chooses the estimation coordinate x: the value itself ("linear") or its natural logarithm ("log",
    for positive values). The prior is Gaussian in that coordinate with standard deviation `prior_std` (for "log":
    a relative one) about `prior_mean` (natural units; None means `value`); an infinite `prior_std` is no prior.
    Raises FlexcalError when the value is outside its bounds or not positive on a log scale.
    """

    name: str
    unit: str
    value: float
    lower: float = -math.inf
    upper: float = math.inf
    prior_std: float = math.inf
    prior_mean: float | None = None
    scale: Literal["linear", "log"] = "linear"

    def __post_init__(self) -> None:
        if self.scale not in ("linear", "log"):
            raise FlexcalError(
                "E-FIT-011", f"Parameter {self.name}: scale is '{self.scale}', must be 'linear' or 'log'."
            )
        if not math.isfinite(self.value):
            raise FlexcalError(
                "E-FIT-012", f"Parameter {self.name}: the start value is {self.value}; give a finite number."
            )
        if not self.lower <= self.value <= self.upper:
            raise FlexcalError(
                "E-FIT-013",
                f"Parameter {self.name}: the start value {self.value:g} {self.unit} is outside its bounds "
                f"[{self.lower:g}, {self.upper:g}]; move the value or the bounds.",
            )
        if not self.prior_std > 0:
            raise FlexcalError(
                "E-FIT-014", f"Parameter {self.name}: prior_std is {self.prior_std}; it must be positive."
            )
        if self.prior_mean is not None and not math.isfinite(self.prior_mean):
            raise FlexcalError(
                "E-FIT-015", f"Parameter {self.name}: prior_mean is {self.prior_mean}; give a finite number."
            )
        mean = self.value if self.prior_mean is None else self.prior_mean
        if self.scale == "log" and min(self.value, mean) <= 0:
            raise FlexcalError(
                "E-FIT-016",
                f"Parameter {self.name}: a log scale needs a positive value and prior mean, "
                f"not {self.value:g} and {mean:g} {self.unit}.",
            )

    def coordinate(self, value: float) -> float:
        """Natural value to estimation coordinate; below a log scale's domain it is -inf."""
        if self.scale == "linear":
            return float(value)
        return math.log(value) if value > 0 else -math.inf

    def natural(self, coordinate: float) -> float:
        """Estimation coordinate to natural value (inf where the exponential overflows)."""
        if self.scale == "linear":
            return float(coordinate)
        return math.exp(coordinate) if coordinate < 709.0 else math.inf


@dataclass(frozen=True)
class Parameters:
    """An ordered, immutable collection of p parameters with unique names."""

    items: tuple[Parameter, ...] = ()
    _index: dict[str, int] = field(init=False, repr=False, compare=False)

    def __init__(self, items: Iterable[Parameter] = ()) -> None:
        """Raises FlexcalError when a name occurs twice."""
        items = tuple(items)
        index = {item.name: number for number, item in enumerate(items)}
        if len(index) != len(items):
            names = [item.name for item in items]
            twice = sorted({name for name in names if names.count(name) > 1})
            raise FlexcalError(
                "E-FIT-017", f"Parameter names must be unique; given more than once: {', '.join(twice)}."
            )
        object.__setattr__(self, "items", items)
        object.__setattr__(self, "_index", index)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self._index)

    @property
    def units(self) -> tuple[str, ...]:
        return tuple(item.unit for item in self.items)

    def __len__(self) -> int:
        return len(self.items)

    def __iter__(self) -> Iterator[Parameter]:
        return iter(self.items)

    def __contains__(self, name: object) -> bool:
        return name in self._index

    def __getitem__(self, key: str | int) -> Parameter:
        return self.items[key if isinstance(key, (int, np.integer)) else self.index(key)]

    def __add__(self, other: Parameters) -> Parameters:
        """The parameters of both, in this order."""
        return Parameters(self.items + other.items)

    def index(self, name: str) -> int:
        """Position of `name`; raises FlexcalError naming the closest ones when there is none."""
        try:
            return self._index[name]
        except KeyError:
            close = get_close_matches(name, self.names, n=3, cutoff=0.4)
            hint = f"did you mean {' or '.join(close)}?" if close else f"there are {len(self)} parameters."
            raise FlexcalError("E-FIT-018", f"There is no parameter '{name}'; {hint}") from None

    def subset(self, names: Iterable[str]) -> Parameters:
        """The named parameters, in the order of `names`."""
        return Parameters(self[name] for name in names)

    def replaced(self, name: str, **changes: Any) -> Parameters:
        """A copy in which the fields `changes` of one parameter are replaced."""
        number = self.index(name)
        return Parameters(
            (*self.items[:number], replace(self.items[number], **changes), *self.items[number + 1 :])
        )

    def with_coordinates(self, x: np.ndarray | Sequence[float]) -> Parameters:
        """A copy whose values are those of the coordinates `x` (p,), clipped into bounds; priors stay where they were."""
        values = np.clip(self.natural(x), [p.lower for p in self], [p.upper for p in self])
        return Parameters(
            replace(
                item,
                value=float(value),
                prior_mean=item.value if item.prior_mean is None else item.prior_mean,
            )
            for item, value in zip(self.items, values, strict=True)
        )

    def coordinates(self, values: Mapping[str, float] | None = None) -> np.ndarray:
        """Estimation coordinates (p,) of the start, with natural `values` put in for the names they give.

        Raises FlexcalError for an unknown name.
        """
        natural = {item.name: item.value for item in self.items}
        for name, value in (values or {}).items():
            natural[self.names[self.index(name)]] = value
        return np.array([item.coordinate(natural[item.name]) for item in self.items], dtype=float)

    def natural(self, x: np.ndarray | Sequence[float]) -> np.ndarray:
        """Natural values (p,) of the estimation coordinates `x` (p,)."""
        return np.array([item.natural(c) for item, c in zip(self.items, x, strict=True)], dtype=float)

    def natural_slope(self, x: np.ndarray | Sequence[float]) -> np.ndarray:
        """d natural / d coordinate (p,) at `x` (p,): 1 for a linear scale, the value itself for a log scale."""
        slopes = [1.0 if p.scale == "linear" else p.natural(c) for p, c in zip(self.items, x, strict=True)]
        return np.array(slopes, dtype=float)

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (p,) in estimation coordinates."""
        lower = np.array([item.coordinate(item.lower) for item in self.items], dtype=float)
        return lower, np.array([item.coordinate(item.upper) for item in self.items], dtype=float)

    def prior_mean(self) -> np.ndarray:
        """Centre of the prior (p,) in estimation coordinates."""
        means = [p.coordinate(p.value if p.prior_mean is None else p.prior_mean) for p in self.items]
        return np.array(means, dtype=float)

    def prior_std(self) -> np.ndarray:
        """Standard deviations of the prior (p,) in estimation coordinates, inf where there is none."""
        return np.array([item.prior_std for item in self.items], dtype=float)

    def prior_information(self) -> np.ndarray:
        """Information matrix of the prior (p, p): diagonal of 1/std², zero where there is no prior."""
        return np.diag(self.prior_std() ** -2.0)
