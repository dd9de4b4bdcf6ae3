"""Files that a description may read: below folders of ROS packages, regular, of bounded size together."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import yaml

from flexcal.errors import InputError, unreadable
from flexcal.export.xacro_expressions import DottedDict, Evaluator, Refused
from flexcal.export.xml_text import XmlText, read_xml_text
from flexcal.files.transaction import read_bytes

MOST_BYTES = 64_000_000
"""Bytes of all files of a description together."""
_MANIFEST = "package.xml"
_MANIFEST_BYTES = 1_000_000
_PACKAGE = re.compile(r"[A-Za-z0-9][\w.-]*")
_YAML_STEPS = 2
"""Steps of an expansion for a byte of YAML."""
_UNITS = {
    "!radians": 1.0,
    "!degrees": 0.017453292519943295,
    "!meters": 1.0,
    "!millimeters": 0.001,
    "!foot": 0.3048,
    "!inches": 0.0254,
}
_LONGEST_SCALAR = 400
"""Characters of a number of YAML."""


class DescriptionFiles:
    """Files of a description as they are read; `replaced` ones have other content.

    `main` is its main file, as messages name it, and `named` are folders of packages by name.
    """

    def __init__(self, main: Path, replaced: Mapping[Path, bytes], named: Mapping[str, Path]) -> None:
        self.main, self.replaced = main, replaced
        self.folder = Path(os.path.abspath(main)).parent
        self.named = {name: Path(os.path.abspath(path)) for name, path in named.items()}
        self.contents: dict[Path, bytes] = {}
        self.sources: dict[Path, XmlText] = {}
        self.packages: set[Path] = set()
        above = (self.folder, *self.folder.parents)
        own = next((path for path in above if (path / _MANIFEST).is_file()), self.folder)
        self._roots = {own, *self.named.values()}
        self._installed: set[Path] = set()

    def first(self) -> XmlText:
        """The main file, which must be XML and may lie anywhere; raises `InputError` if it cannot be read."""
        path = self.folder / self.main.name
        try:
            content = self._content(path)
        except OSError as problem:
            raise unreadable(self.show(path), problem) from problem
        self.contents[path] = content
        self.sources[path] = read_xml_text(self.show(path), content)
        return self.sources[path]

    def xml(self, name: str) -> XmlText:
        """A file that is included; raises `OSError` where it is missing, and `InputError`."""
        path = self._read(name)
        if path not in self.sources:
            self.sources[path] = read_xml_text(self.show(path), self.contents[path])
        return self.sources[path]

    def yaml(self, name: str, evaluator: Evaluator, names: Mapping[str, Any]) -> Any:
        """Value of a YAML file; raises `Refused` where it cannot be read."""
        try:
            path = self._read(name)
            content = self.contents[path]
            evaluator.work.spend(_YAML_STEPS * len(content))
            loader = _Loader(content.decode("utf-8"))
            loader.evaluator, loader.names = evaluator, names
            try:
                return loader.get_single_data()
            finally:
                loader.dispose()
        except (Refused, InputError):
            raise
        except OSError as problem:
            raise Refused(f"{name} cannot be read ({problem.strerror})") from None
        except (yaml.YAMLError, ValueError, TypeError, ArithmeticError, RecursionError) as problem:
            reason = getattr(problem, "problem", None) or problem
            raise Refused(
                f"{name} is no YAML that is read here ({' '.join(str(reason).split())[:100]})"
            ) from None

    def matching(self, pattern: str) -> list[str]:
        """Names of files that match a pattern, whose folder has no wildcards."""
        folder, name = os.path.split(pattern)
        if re.search(r"[*?\[]", folder):
            raise Refused("wildcards stand in the name of a file alone")
        place = Path(os.path.abspath(folder))
        self._require_inside(place)
        try:
            names = sorted(os.listdir(place))
        except OSError:
            return []
        hidden = name.startswith(".")
        return [
            os.path.join(folder, each)
            for each in names
            if fnmatchcase(each, name) and (hidden or each[0] != ".")
        ]

    def package(self, name: str) -> Path:
        """Folder of a ROS package: of those named, around the main file, or where ROS has it; raises `InputError`."""
        found = self.named.get(name) or (self._around(name) if _PACKAGE.fullmatch(name) else None)
        if found is None:
            try:
                from ament_index_python.packages import (  # pyright: ignore[reportMissingImports]
                    get_package_share_directory,
                )

                found = Path(os.path.abspath(get_package_share_directory(name)))
                self._installed.add(found)
            except Exception:
                raise InputError(
                    "E-ROS-005",
                    f"{self.main}: the package '{name}' is not found; say where it is: --packages {name}=FOLDER.",
                ) from None
        self._roots.add(found)
        self.packages.add(found)
        return found

    def show(self, path: Path) -> Path:
        """A file as messages name it."""
        return self.main.parent / path.relative_to(self.folder) if path.is_relative_to(self.folder) else path

    def where(self, text: str, files: list[Path]) -> str:
        """File and line of the element that has a text, looked for in these `files` first; the last of them where none has it."""
        for path in dict.fromkeys([*reversed(files), *self.sources]):
            source = self.sources.get(path)
            for element in () if source is None else source.elements:
                if any(text in place.value for place in element.attributes.values()) or text in element.text:
                    return f"{self.show(path)} line {element.line}"
        return str(self.show(files[-1]))

    def _read(self, name: str) -> Path:
        path = Path(os.path.abspath(name))
        if path not in self.contents:
            if path not in self.replaced:
                self._require_inside(path)
            self.contents[path] = self._content(path)
        return path

    def _content(self, path: Path) -> bytes:
        content = self.replaced[path] if path in self.replaced else read_bytes(path, limit=MOST_BYTES)
        if len(content) + sum(map(len, self.contents.values())) > MOST_BYTES:
            raise InputError(
                "E-ROS-033",
                f"{self.show(path)}: with it the files of the description have more than {MOST_BYTES // 1_000_000} MB; leave out what "
                "is no part of the robot.",
            )
        return content

    def _require_inside(self, path: Path) -> None:
        """Raise `InputError` for a file outside of the packages, and for one that a link leads out of them."""
        real = Path(os.path.realpath(path))
        if any(path.is_relative_to(root) for root in self._installed):
            return
        if not any(path.is_relative_to(root) for root in self._roots) or not any(
            real.is_relative_to(os.path.realpath(root)) for root in self._roots
        ):
            raise InputError(
                "E-ROS-034",
                f"{self.show(path)} is no file of the packages of {self.main}, and only these are read; name the folder that has it as a "
                "package: --packages NAME=FOLDER.",
            )

    def _around(self, name: str) -> Path | None:
        """Folder of a package in which or beside which the main file's folder lies, by its package.xml."""
        for folder in (self.folder, *self.folder.parents):
            for near in (folder, folder / name):
                manifest = near / _MANIFEST
                if (near is not folder and near.is_symlink()) or not manifest.is_file():
                    continue
                if near.name == name or self._is_named(manifest, name):
                    return near
        return None

    def _is_named(self, manifest: Path, name: str) -> bool:
        try:
            content = read_bytes(manifest, limit=_MANIFEST_BYTES)
        except (OSError, InputError):
            return False
        return f"<name>{name}</name>".encode() in content


class _Loader(yaml.SafeLoader):
    """Reader of YAML with units, whose mappings have dots, and which repeats values as far as the work allows."""

    evaluator: Evaluator
    names: Mapping[str, Any]

    def get_single_data(self) -> Any:
        return self.evaluator.measured(super().get_single_data())

    def flatten_mapping(self, node: yaml.MappingNode) -> None:
        for key, value in node.value:
            if key.tag == "tag:yaml.org,2002:merge":
                for merged in value.value if isinstance(value, yaml.SequenceNode) else [value]:
                    if isinstance(merged, yaml.MappingNode):
                        self.flatten_mapping(merged)
                        self.evaluator.work.spend(len(merged.value))
        super().flatten_mapping(node)

    def dotted(self, node: yaml.MappingNode) -> Iterator[DottedDict]:
        mapping = DottedDict()
        yield mapping
        mapping.update(self.construct_mapping(node))

    def integer(self, node: yaml.ScalarNode) -> int:
        if len(node.value) > _LONGEST_SCALAR:
            raise ValueError("a number is too long")
        return self.construct_yaml_int(node)

    def unit(self, node: yaml.ScalarNode) -> float:
        value = self.evaluator.evaluate(str(self.construct_scalar(node)), self.names)
        return float(value) * _UNITS[node.tag]


_Loader.add_constructor("tag:yaml.org,2002:map", _Loader.dotted)
_Loader.add_constructor("tag:yaml.org,2002:int", _Loader.integer)
for _tag in _UNITS:
    _Loader.add_constructor(_tag, _Loader.unit)
