"""Expansion of xacro files, with the place in the sources from which every element comes."""

from __future__ import annotations

import contextlib
import itertools
import keyword
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn
from xml.dom import minidom

from flexcal.errors import FlexcalError, InputError
from flexcal.export.xacro_expressions import LARGEST_VALUE, Evaluator, Exhausted, Refused, Work
from flexcal.export.xacro_files import DescriptionFiles
from flexcal.export.xacro_functions import METHODS, functions
from flexcal.export.xml_text import XmlText
from flexcal.model.urdf import Element, macro_in

XACRO = "http://www.ros.org/wiki/xacro"
_PLACE = "flexcal-place"
_DEEPEST = 400
"""How deep elements, macros and includes nest together."""
_STACK = 3000
"""Calls of Python that nest while a description is expanded."""
_NODES = 64
"""Nodes or characters that are one step where they are only looked through."""
_PIECE = re.compile(
    r"(?P<dollars>\$\$+[{(])|\$\{(?P<value>[^}]*)\}|\$\((?P<command>[^)]*)\)|(?P<text>[^$]+|\$[^{($]+|\$\Z)"
)
_PARAMETER = re.compile(
    r"^\s*([^\s:=]+?)\s*:?=\s*(\^\|?)?(\$\{[^}]*\}|\$\([^)]*\)|(?:'[^']*+'|\"[^\"]*+\"|[^\s'\"]++)++|)(?:\s+|$)(.*)"
)
"""Parameter of a macro with its default; as in xacro, but in linear time."""
_FORBIDDEN = ("open", "eval", "exec", "compile")
_QUOTED = 100
"""Characters of an expression that a message quotes."""


@dataclass(eq=False)
class ExpandedElement:
    """Element of the expanded description; `place` is the file and the element in it from which it comes, None where xacro made it."""

    tag: str
    attributes: dict[str, str]
    place: tuple[Path, int] | None
    parent: ExpandedElement | None
    text: str = ""
    children: list[ExpandedElement] = field(default_factory=list)

    def find(self, tag: str) -> ExpandedElement | None:
        """First child with this tag."""
        return next((child for child in self.children if child.tag == tag), None)

    def walk(self) -> Iterator[ExpandedElement]:
        """The element and all in it, in the order of the file."""
        waiting: list[ExpandedElement] = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting += element.children[::-1]


@dataclass(frozen=True, eq=False)
class Expansion:
    """Expanded description: its `root`, its plain `text`, and all files read, with their content; XML files with their elements too.

    The first file is the main one. `packages` are the folders of ROS packages that were looked up.
    """

    root: ExpandedElement
    text: str
    contents: Mapping[Path, bytes]
    sources: Mapping[Path, XmlText]
    packages: frozenset[Path]

    def located(self, element: ExpandedElement) -> Element:
        """An element and all in it as those of a URDF, with the file and line from which each comes."""
        place, at = element.place, element
        while place is None and at.parent is not None:
            at = at.parent
            place = at.place
        path, number = place or (next(iter(self.contents)), 0)
        source = self.sources[path]
        children = [self.located(child) for child in element.children]
        return Element(source.path, element.tag, element.attributes, source.elements[number].line, children)


@dataclass(frozen=True, eq=False)
class XacroSource:
    """A xacro file or a URDF, the values of its arguments, and folders of ROS packages by name.

    A package that is not named is looked for around the file, by its package.xml or its folder's name, then where ROS has it. Nothing is
    read outside of these packages, and nothing of a file is executed: its expressions are evaluated here.
    """

    path: Path
    arguments: Mapping[str, str]
    packages: Mapping[str, Path]
    work: Work = field(default_factory=Work, repr=False)

    def expand(self, replaced: Mapping[Path, bytes]) -> Expansion:
        """The description, with the files `replaced` having other content.

        Raises `InputError` where a file is missing or not well-formed, where xacro refuses it, and where xacro is needed and absent.
        """
        files = DescriptionFiles(self.path, replaced, self.packages)
        first = files.first()
        main = next(iter(files.contents))
        self.work.begin()
        limit = sys.getrecursionlimit()
        sys.setrecursionlimit(max(limit, _STACK))
        try:
            if _has_macros(first):
                document, text = self._processed(main, files)
            else:
                document = _document(main, first, self.work)
                text = document.toxml()
            root = _element(document.documentElement, None)
        except Exhausted:
            raise InputError(
                "E-ROS-036",
                f"{self.path}: expanding it takes more than {Work.SINGLE:,} steps, or {Work.TOTAL:,} in all, as with macros that call or "
                "properties that double themselves; correct that, or expand it with xacro and use export urdf.",
            ) from None
        except RecursionError:
            raise InputError(
                "E-ROS-035",
                f"{self.path}: its elements nest too deep for a robot; name the robot's description.",
            ) from None
        finally:
            sys.setrecursionlimit(limit)
        return Expansion(root, text, files.contents, files.sources, frozenset(files.packages))

    def _processed(self, main: Path, files: DescriptionFiles) -> tuple[Any, str]:
        """Document of the package xacro, which evaluates, reads and says nothing by itself, and its text."""
        try:
            import xacro
            from xacro import substitution_args
        except ImportError:
            raise InputError("E-ROS-003", f"{self.path}: macros need xacro: pip install xacro.") from None
        try:
            hooks = _Hooks(xacro, files, self.work, self.arguments)
            with _replaced(self.path, substitution_args, {}), _replaced(self.path, xacro, hooks.names()):
                document: Any = xacro.process_file(str(main), mappings=dict(self.arguments), verbosity=0)
            return document, document.toxml()  # fails for what an expression made and XML cannot hold
        except (FlexcalError, Exhausted, RecursionError):
            raise
        except Exception as problem:  # whatever the package raises about a foreign file
            last = Path((xacro.filestack or [str(main)])[-1] or main)
            reason = " ".join(str(problem).split()) or type(problem).__name__
            raise InputError(
                "E-ROS-004",
                f"{files.show(last)}: xacro cannot expand it ({reason[:200]}); give its arguments with --arguments NAME:=VALUE and folders "
                "of packages with --packages NAME=FOLDER.",
            ) from problem


class _Hooks:
    """Functions in the place of the package's own: what evaluates, reads, prints, and what makes much of little is counted."""

    def __init__(self, xacro: Any, files: DescriptionFiles, work: Work, arguments: Mapping[str, str]) -> None:
        self.xacro, self.files, self.work, self.arguments = xacro, files, work, arguments
        self.evaluator = Evaluator(work, METHODS)
        self.functions = functions(self._load_yaml, xacro.abs_filename_spec, self._argument)
        self.depth = 0
        self._loaded: dict[str, Any] = {}
        self._eval_all, self._replace_node = xacro.eval_all, xacro.replace_node

    def names(self) -> dict[str, Any]:
        """Functions and values by their names in the package."""
        return {
            "_global_symbols": self.functions,
            "all_includes": [],
            "re_macro_arg": _PARAMETER,
            "parse": self.parse,
            "eval_text": self.eval_text,
            "safe_eval": _refuse,
            "load_yaml": _refuse,
            "eval_extension": self.command,
            "get_include_files": self.include_files,
            "is_valid_name": lambda name: name.isidentifier() and not keyword.iskeyword(name),
            "eval_all": self.eval_all,
            "replace_node": self.replace_node,
            "warning": lambda *_, **__: None,
            "error": lambda *_, **__: None,
            "message": lambda *_, **__: None,
            "print_location": lambda *_, **__: None,
        }

    def parse(self, _: Any, name: str) -> Any:
        """Document of the main file or an included one."""
        path = Path(os.path.abspath(name))
        try:
            source = self.files.sources.get(path) or self.files.xml(name)
        except OSError as problem:
            self.xacro.filestack.pop()
            raise self.xacro.XacroException(f"{problem.strerror}: {name}", exc=problem) from problem
        return _document(path, source, self.work)

    def eval_text(self, text: str, symbols: Any) -> Any:
        """Value of a text: of its only expression, or the text with what its expressions make."""
        results: list[Any] = []
        end = 0
        for piece in _PIECE.finditer(text):
            if piece.start() != end:
                break
            end = piece.end()
            if piece["value"] is not None:
                results.append(self._located(piece[0], self._evaluated, piece["value"], symbols))
            elif piece["command"] is not None:
                results.append(self.command(str(self.eval_text(piece[0][2:-1], symbols)).join(("$(", ")"))))
            else:
                results.append(piece["text"] or piece["dollars"][1:])
        if end != len(text):
            raise self._unevaluated(text, "a '$' is not followed by a closed {…} or (…)")
        if len(results) == 1:
            return results[0]
        return self._located(text, self._joined, results)

    def command(self, text: str) -> str:
        """Value of $(arg …), $(find …), $(env …), $(optenv …) or $(cwd)."""
        return self._located(text, self._commanded, text[2:-1].split())

    def include_files(self, spec: str, symbols: Any) -> Iterator[str]:
        """Names of the files that an include means."""
        name = self.xacro.abs_filename_spec(str(self.eval_text(spec, symbols)))
        if not re.search(r"[*?\[]", name):
            return iter([name])
        return iter(self._located(spec, self.files.matching, name))

    def eval_all(self, node: Any, macros: Any, symbols: Any) -> None:
        """Expand all in a node, whose size is counted."""
        children = node.childNodes
        own = sum(child.nodeName.startswith("xacro:") for child in children)
        letters = sum(len(child.data) for child in children if child.nodeType != child.ELEMENT_NODE)
        attributes = [len(value) for _, value in node.attributes.items()]
        looked = own * len(children) + len(attributes) ** 2 + letters + sum(attributes)
        self.work.spend(1 + len(children) + len(attributes) + looked // _NODES)
        self.depth += 1
        try:
            if self.depth > _DEEPEST:
                raise RecursionError
            self._eval_all(node, macros, symbols)
        finally:
            self.depth -= 1

    def replace_node(self, node: Any, by: Any, content_only: bool = False) -> None:
        """Put others in the place of a node; as lists of nodes are searched, the cost grows with both."""
        others = by if isinstance(by, list) else [] if by is None else [by]
        count = 1 + sum(len(each.childNodes) if content_only else 1 for each in others)
        self.work.spend(count + count * (count + len(node.parentNode.childNodes)) // _NODES)
        self._replace_node(node, by, content_only)

    def _evaluated(self, text: str, symbols: Any) -> Any:
        value = self.evaluator.evaluate(str(self.eval_text(text, symbols)), symbols)
        return value if type(value) is str else self.evaluator.measured(value)

    def _joined(self, results: list[Any]) -> str:
        texts = [str(self.evaluator.measured(result)) for result in results]
        if sum(map(len, texts)) > LARGEST_VALUE:
            raise Refused("the text is too long")
        return "".join(texts)

    def _commanded(self, words: list[str]) -> str:
        match words:
            case ["arg", name]:
                return self._argument(name)
            case ["find", package]:
                return str(self.files.package(package))
            case ["env", name]:
                if name not in self.arguments:
                    raise Refused(f"give the value with --arguments {name}:=VALUE")
                return self.arguments[name]
            case ["optenv", name, *otherwise]:
                return self.arguments.get(name, " ".join(otherwise))
            case ["cwd"]:
                return os.getcwd()
        raise Refused("only $(arg NAME), $(find PACKAGE), $(env NAME), $(optenv NAME VALUE) and $(cwd) are")

    def _argument(self, name: str) -> Any:
        given = self.xacro.substitution_args_context["arg"]
        if name not in given:
            raise Refused(f"give the argument with --arguments {name}:=VALUE")
        return given[name]

    def _load_yaml(self, name: str) -> Any:
        path = self.xacro.abs_filename_spec(name)
        if path not in self._loaded:
            self._loaded[path] = self.files.yaml(path, self.evaluator, self.functions)
        return self._loaded[path]

    def _located(self, text: str, function: Callable[..., Any], *given: Any) -> Any:
        """What a function makes of a text; its refusal names the file and line."""
        try:
            return function(*given)
        except Exhausted:
            raise
        except Refused as problem:
            raise self._unevaluated(text, str(problem)) from None

    def _unevaluated(self, text: str, reason: str) -> InputError:
        stack = [Path(os.path.abspath(name)) for name in self.xacro.filestack if name]
        quoted = text if len(text) <= _QUOTED else f"{text[:_QUOTED]}…"
        return InputError(
            "E-ROS-037", f"{self.files.where(text, stack)}: {quoted} is not evaluated: {reason}."
        )


def _refuse(*_: Any, **__: Any) -> NoReturn:
    raise Refused("this is not done here")


@contextlib.contextmanager
def _replaced(path: Path, module: Any, names: Mapping[str, Any]) -> Iterator[None]:
    """Within it a module has other values, and none of the functions of Python that execute or open; one without the names is refused."""
    missing = [name for name in names if not hasattr(module, name)]
    if missing:
        raise InputError(
            "E-ROS-038",
            f"{path}: macros need xacro 2.1, and this one lacks {missing[0]}; install it: pip install 'xacro>=2.1,<2.2'.",
        )
    before = {name: getattr(module, name) for name in names}
    for name, value in {**names, **dict.fromkeys(_FORBIDDEN, _refuse)}.items():
        setattr(module, name, value)
    try:
        yield
    finally:
        for name in _FORBIDDEN:
            delattr(module, name)
        for name, value in before.items():
            setattr(module, name, value)


class _Copied:
    """What minidom tells of a copied element: it has the place of the first one, and is counted."""

    def __init__(self, work: Work) -> None:
        self.work = work

    def handle(self, operation: int, key: str, data: Any, src: Any, dst: Any) -> None:
        self.work.spend(1 + len(src.childNodes))
        dst.setUserData(key, data, self)


def _document(path: Path, source: XmlText, work: Work) -> Any:
    """Document of a file, whose elements, but for those of xacro, know their places."""
    work.spend(len(source.content) // 2)
    document: Any = minidom.parseString(source.content.decode("utf-8-sig"))
    copied = _Copied(work)
    numbers = itertools.count()
    waiting = [document.documentElement]
    while waiting:
        node = waiting.pop()
        place = (path, next(numbers))
        node.setUserData(_PLACE, () if node.tagName.startswith("xacro:") else place, copied)
        waiting += [child for child in reversed(node.childNodes) if child.nodeType == child.ELEMENT_NODE]
    return document


def _has_macros(source: XmlText) -> bool:
    prefixes = {"xacro"}
    return source.path.suffix == ".xacro" or any(
        macro_in(element.tag, {name: place.value for name, place in element.attributes.items()}, prefixes)
        for element in source.elements
    )


def _element(node: Any, parent: ExpandedElement | None) -> ExpandedElement:
    attributes = dict(node.attributes.items())
    said = "".join(child.data for child in node.childNodes if child.nodeType == node.TEXT_NODE).strip()
    element = ExpandedElement(node.tagName, attributes, node.getUserData(_PLACE) or None, parent, said)
    element.children = [
        _element(child, element) for child in node.childNodes if child.nodeType == node.ELEMENT_NODE
    ]
    return element
