"""Reading and writing of `estimates.yaml` and `estimates.npz`, one block per identification.

The YAML has for every block the named values with unit, standard deviation and 95 % interval, what could not be told
apart, the fit and the provenance; the npz has `<block>.names` (p,) and `<block>.covariance` (p, p), in estimation
coordinates (of a value whose scale is `log`: its natural logarithm).
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from flexcal import __version__
from flexcal.errors import FlexcalError, InputError, unreadable
from flexcal.estimation import Dropped, Estimate, Misfit, Parameter, Parameters
from flexcal.files.formats.npz_reader import ArrayForm, NpzFile, refuse_foreign
from flexcal.files.formats.yaml_reader import YamlFile, read_yaml_file
from flexcal.files.formats.yaml_writer import to_plain, yaml_text
from flexcal.files.transaction import (
    FileTransaction,
    current_path,
    files_on_disk,
    open_regular,
    refuse_irregular,
)

Block = Literal["dynamics", "stiffness", "calibration", "payload", "actuators"]
BLOCKS: tuple[Block, ...] = get_args(Block)
"""Blocks of the file, in the order of their application to a robot."""
_BEFORE = "before"
"""Part of the names of arrays that belong to the block as it was before it was written last."""
Matrices = dict[Block, tuple[tuple[str, ...], np.ndarray]]
"""Names and covariance of blocks."""


@dataclass(frozen=True)
class StoredValue:
    """One value as it stands in the file; std, low and high are absent where it is not identifiable."""

    estimate: float
    unit: str = ""
    std: float | None = None
    low: float | None = None
    high: float | None = None
    identifiable: bool | None = None
    scale: Literal["linear", "log"] = "linear"
    lower: float | None = None
    upper: float | None = None
    prior_std: float | None = None
    prior_mean: float | None = None

    def __post_init__(self) -> None:
        if self.std is not None and self.std < 0:
            raise FlexcalError("E-EST-001", f"a standard deviation must not be negative, not {self.std:g}.")
        if self.low is not None and self.high is not None and not self.low <= self.high:
            raise FlexcalError(
                "E-EST-002", f"the interval from {self.low:g} to {self.high:g} has its ends exchanged."
            )


@dataclass(frozen=True)
class StoredDropped:
    """A parameter that was held, with the kept ones that absorb it and their coefficients."""

    name: str
    absorbed_by: dict[str, float] = field(default_factory=dict)


@dataclass(frozen=True)
class StoredFit:
    """Statistics of the fit."""

    rank: int
    cost: float
    chi2: float
    degrees_of_freedom: int
    status: str
    message: str
    iterations: int
    outliers: tuple[int, ...] = ()
    covariance_freedom: float | None = None
    misfit: Misfit | None = None

    def __post_init__(self) -> None:
        if min(self.rank, self.chi2, self.degrees_of_freedom, self.iterations) < 0:
            raise FlexcalError(
                "E-EST-003", "rank, chi2, degrees_of_freedom and iterations must not be negative."
            )


@dataclass(frozen=True)
class StoredBlock:
    """Block of one identification in the file."""

    values: dict[str, StoredValue]
    dropped: tuple[StoredDropped, ...] = ()
    fit: StoredFit | None = None
    covariance_sha256: str | None = None
    ranges: dict[str, tuple[float, float]] = field(default_factory=dict)
    measurements: str | None = None
    provenance: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class StoredEstimates:
    """Content of the whole file."""

    dynamics: StoredBlock | None = None
    stiffness: StoredBlock | None = None
    calibration: StoredBlock | None = None
    payload: StoredBlock | None = None
    actuators: StoredBlock | None = None

    def block(self, name: Block) -> StoredBlock | None:
        """One block, where it is there."""
        return getattr(self, name)


def read_estimates(path: str | Path, *, without: Block | None = None) -> dict[Block, Estimate]:
    """The estimates of a file by block, in the order of `BLOCKS`, leaving out `without` (the block to be made anew).

    Raises `InputError` with file and line where the YAML does not fit, and where the npz is missing, has other names
    or shapes, or belongs to another YAML.
    """
    file = read_yaml_file(path)
    stored = file.structure(StoredEstimates)
    estimates: dict[Block, Estimate] = {}
    for name in BLOCKS:
        block = stored.block(name)
        if block is not None and name != without:
            estimates[name] = _estimate(file, name, block, _covariance(file, name, block))
    return estimates


def write_estimates(path: str | Path, block: Block, estimate: Estimate) -> None:
    """Put an estimate into its block of the file, made where it is not there; the other blocks stay as they are.

    No other run writes the file from its reading to the end of the running transaction. The npz file takes its place first, and has beside
    each new covariance that of the YAML file which is there still: wherever the process is killed, the YAML finds the one of its SHA-256.
    Raises `InputError` where another block of the file cannot be read, and where the npz is of another program, and `FlexcalError` where
    the estimate holds a number that is not finite.
    """
    path = Path(path)
    if block not in BLOCKS:
        raise FlexcalError(
            "E-EST-004", f"there is no block '{block}' in an estimates file; there are {', '.join(BLOCKS)}."
        )
    with FileTransaction.joined() as run:
        binary = path.with_suffix(".npz")
        run.hold(path)
        run.hold(binary)
        stored, arrays = _kept(path, block)
        covariance = np.asarray(estimate.covariance, dtype=np.float64)
        size = len(estimate.parameters)
        if covariance.shape != (size, size) or not np.isfinite(covariance).all():
            raise FlexcalError(
                "E-EST-005",
                f"the covariance of the {block} must be finite and ({size}, {size}), not {covariance.shape}.",
            )
        arrays[block] = (estimate.parameters.names, covariance)
        stored = replace(stored, **{block: _stored(estimate, covariance)})
        replaced = _replaced(path, arrays)
        named: dict[str, np.ndarray] = {}
        for name in BLOCKS:
            for prefix, kept in ((name, arrays), (f"{name}.{_BEFORE}", replaced)):
                named |= _members(prefix, *kept[name]) if name in kept else {}
        with run.writing(binary, path) as (matrices, plain):
            with matrices.open("wb") as stream:
                np.savez(stream, allow_pickle=False, **named)
            plain.write_text(yaml_text(stored), encoding="utf-8", newline="")


def require_place(path: str | Path, block: Block) -> None:
    """Raise `InputError` if `write_estimates` could not put a block into this file, before the work begins."""
    for file in (Path(path), Path(path).with_suffix(".npz")):
        refuse_irregular(file)
    _kept(Path(path), block)


def provenance(
    inputs: Iterable[str | Path] = (),
    options: Mapping[str, object] | None = None,
    estimates: str | Path | None = None,
    blocks: Iterable[Block] = (),
) -> dict[str, str]:
    """Provenance of an estimate: program version, SHA-256 of input files and folders by name (with the path where a name repeats),
    options, and the SHA-256 of the `blocks` used from the file `estimates`.
    """
    origin = {"program": f"flexcal {__version__}"}
    paths = [Path(path) for path in inputs]
    names = [path.name for path in paths]
    origin |= {f"input.{p.name if names.count(p.name) == 1 else p.as_posix()}": sha256_of(p) for p in paths}
    origin |= {f"option.{name}": str(value) for name, value in (options or {}).items()}
    if estimates is not None:
        origin |= {f"block.{block}": block_sha256(estimates, block) for block in blocks}
    return origin


def sha256_of(path: str | Path, *, limit: int | None = None) -> str:
    """SHA-256 of a file of at most `limit` bytes; of a folder: of the names and SHA-256 of all files in it, in the order of their names."""
    path = Path(path)
    digest = hashlib.sha256()
    try:
        if path.is_dir():
            for file in sorted(file for file in path.rglob("*") if file.is_file()):
                digest.update(
                    f"{file.relative_to(path).as_posix()}\0{sha256_of(file, limit=limit)}\n".encode()
                )
        else:
            with open_regular(path, limit=limit) as stream:
                while content := stream.read(2**20):
                    digest.update(content)
    except OSError as problem:
        raise unreadable(path, problem) from problem
    return digest.hexdigest()


def block_sha256(path: str | Path, block: Block) -> str:
    """SHA-256 of a block's values and covariance, whatever its provenance; raises `InputError` where it is not there."""
    file = read_yaml_file(path)
    stored = file.structure(StoredEstimates).block(block)
    if stored is None:
        raise file.error(
            "E-EST-006", (), f"there is no block '{block}'; run the identification that makes it."
        )
    content = to_plain({"values": stored.values, "dropped": stored.dropped})
    content["covariance"] = stored.covariance_sha256
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _kept(path: Path, block: Block) -> tuple[StoredEstimates, Matrices]:
    """Content to be kept when `block` is written: the file's content, and names and covariance of the other blocks."""
    if path.suffix not in (".yaml", ".yml"):
        raise InputError(
            "E-EST-007",
            f"{path}: estimates are written to a .yaml file (with an .npz beside it); give such a name.",
        )
    stored, arrays = StoredEstimates(), {}
    prefixes = [f"{name}{before}" for name in BLOCKS for before in ("", f".{_BEFORE}")]
    refuse_foreign(path.with_suffix(".npz"), {f"{one}.{part}" for one in prefixes for part in _PARTS})
    if current_path(path).exists():
        file = read_yaml_file(path)
        stored = file.structure(StoredEstimates)
        for name in BLOCKS:
            other = stored.block(name)
            if other is not None and name != block and other.covariance_sha256 is not None:
                arrays[name] = (tuple(other.values), _covariance(file, name, other))
    return stored, arrays


_PARTS = ("names", "covariance")


def _members(prefix: str, names: tuple[str, ...], covariance: np.ndarray) -> dict[str, np.ndarray]:
    return dict(
        zip((f"{prefix}.{part}" for part in _PARTS), (np.array(names, dtype=str), covariance), strict=True)
    )


def _replaced(path: Path, arrays: Matrices) -> Matrices:
    """What is replaced: of blocks that change, the covariance that the YAML file on the disk has; of others, what was replaced before."""
    replaced: Matrices = {}
    try:
        with files_on_disk():
            stored = read_yaml_file(path).structure(StoredEstimates)
            file = NpzFile(path.with_suffix(".npz"), "")
            for name, (_, covariance) in arrays.items():
                found = {_sha256(one): (names, one) for names, one in _versions(file, name)}
                block = stored.block(name)
                kept = found.pop(block.covariance_sha256 or "", None) if block is not None else None
                if kept is not None and not np.array_equal(kept[1], covariance):
                    replaced[name] = kept
                elif found:
                    replaced[name] = next(iter(found.values()))
    except InputError:  # there are none yet, or none that can be read
        return replaced
    return replaced


def _versions(file: NpzFile, name: Block) -> Iterator[tuple[tuple[str, ...], np.ndarray]]:
    """Names and covariances of a block, the present one first."""
    for prefix in (name, f"{name}.{_BEFORE}"):
        names, covariance = (f"{prefix}.{part}" for part in _PARTS)
        if names in file and covariance in file:
            size = f"names of {prefix}"
            forms = {names: ArrayForm("text", (size,)), covariance: ArrayForm("real", (size, size))}
            read = file.read(forms)
            yield tuple(read[names].tolist()), read[covariance]


def _covariance(file: YamlFile, name: Block, block: StoredBlock) -> np.ndarray:
    """The covariance (p, p) of a block, checked against the YAML."""
    path = file.path.with_suffix(".npz")
    again = "run the identification again"
    if block.covariance_sha256 is None or block.fit is None:
        raise file.error(
            "E-EST-008", (name,), f"the block '{name}' has values only, so it is no estimate; {again}."
        )
    versions = list(_versions(NpzFile(path, f"it belongs to {file.path.name}: {again}"), name))
    if not versions:
        raise InputError(
            "E-EST-009", f"{path}: the names and covariance of the block '{name}' are missing; {again}."
        )
    size = len(block.values)
    for names, covariance in versions:
        fits = covariance.shape == (size, size) and list(names) == list(block.values)
        if fits and covariance.dtype == np.float64 and _sha256(covariance) == block.covariance_sha256:
            return covariance
    names, covariance = versions[0]
    if covariance.shape != (size, size):
        raise InputError(
            "E-EST-010",
            f"{path}: {name}.covariance has the shape {covariance.shape}, not ({size}, {size}); {again}.",
        )
    if list(names) != list(block.values):
        raise InputError(
            "E-EST-011", f"{path}: {name}.names are not the values of {file.path.name}; {again}."
        )
    raise InputError("E-EST-012", f"{path}: {name}.covariance does not belong to {file.path.name}; {again}.")


def _estimate(file: YamlFile, name: Block, block: StoredBlock, covariance: np.ndarray) -> Estimate:
    fit = block.fit
    assert fit is not None
    try:
        parameters = Parameters(_parameter(key, value) for key, value in block.values.items())
    except FlexcalError as problem:
        raise file.error(problem.code, (name, "values"), str(problem)) from problem
    for i, entry in enumerate(block.dropped):
        for unknown in {entry.name, *entry.absorbed_by} - set(parameters.names):
            raise file.error(
                "E-EST-013",
                (name, "dropped", i),
                f"'{unknown}' is not among the values of this block; correct the name.",
            )
    return Estimate(
        parameters=parameters,
        covariance=covariance,
        rank=fit.rank,
        dropped=tuple(Dropped(entry.name, tuple(entry.absorbed_by.items())) for entry in block.dropped),
        identifiable=tuple(value.identifiable is not False for value in block.values.values()),
        cost=fit.cost,
        chi2=fit.chi2,
        degrees_of_freedom=fit.degrees_of_freedom,
        status=fit.status,
        message=fit.message,
        iterations=fit.iterations,
        outliers=fit.outliers,
        covariance_freedom=fit.covariance_freedom,
        misfit=fit.misfit,
        provenance=dict(block.provenance),
        ranges=dict(block.ranges),
        measurements=tuple((block.measurements or "").split()),
    )


def _parameter(name: str, value: StoredValue) -> Parameter:
    return Parameter(
        name=name,
        unit=value.unit,
        value=value.estimate,
        lower=-math.inf if value.lower is None else value.lower,
        upper=math.inf if value.upper is None else value.upper,
        prior_std=math.inf if value.prior_std is None else value.prior_std,
        prior_mean=value.prior_mean,
        scale=value.scale,
    )


def _stored(estimate: Estimate, covariance: np.ndarray) -> StoredBlock:
    return StoredBlock(
        values={item.name: _stored_value(estimate, item) for item in estimate.parameters},
        dropped=tuple(StoredDropped(entry.name, dict(entry.absorbed_by)) for entry in estimate.dropped),
        fit=StoredFit(
            rank=int(estimate.rank),
            cost=float(estimate.cost),
            chi2=float(estimate.chi2),
            degrees_of_freedom=int(estimate.degrees_of_freedom),
            status=estimate.status,
            message=estimate.message,
            iterations=int(estimate.iterations),
            outliers=tuple(int(number) for number in estimate.outliers),
            covariance_freedom=estimate.covariance_freedom,
            misfit=estimate.misfit,
        ),
        covariance_sha256=_sha256(covariance),
        ranges={str(key): (float(low), float(high)) for key, (low, high) in estimate.ranges.items()},
        measurements=" ".join(estimate.measurements) or None,
        provenance={str(key): str(value) for key, value in estimate.provenance.items()},
    )


def _stored_value(estimate: Estimate, item: Parameter) -> StoredValue:
    quantity = estimate.quantity(item.name)
    low, high, std = (quantity[key] for key in ("low", "high", "std"))
    return StoredValue(
        estimate=float(item.value),
        unit=item.unit,
        std=None if std is None else float(std),
        low=None if low is None else float(low),
        high=None if high is None else float(high),
        identifiable=bool(quantity["identifiable"]),
        scale=item.scale,
        lower=_finite(item.lower),
        upper=_finite(item.upper),
        prior_std=_finite(item.prior_std),
        prior_mean=None if item.prior_mean is None else float(item.prior_mean),
    )


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _sha256(array: np.ndarray) -> str:
    return hashlib.sha256(np.ascontiguousarray(array, dtype="<f8").tobytes()).hexdigest()
