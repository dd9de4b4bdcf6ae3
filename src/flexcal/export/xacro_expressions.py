"""Expressions of xacro files, evaluated without Python: values and the functions given, no attributes, in bounded time and memory."""

from __future__ import annotations

import ast
import datetime
import operator
import re
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

LARGEST_VALUE = 1_000_000
"""Largest number of items and characters of a value."""
_LARGEST_INTEGER = 1024
"""Bits of an integer, those of the largest double."""
_LONGEST, _DEEPEST = 10_000, 50
"""Characters of an expression, and how deep it nests."""
_CHARACTERS = 64
"""Characters that are one step."""
_SCALARS = (type(None), bool, int, float, str, datetime.date, datetime.datetime)
_NUMBERS = (bool, int, float)
_SEQUENCES = (str, list, tuple)
_FORMAT = re.compile(r"%(?:%|[-+ 0#]{0,5}\d{0,2}(?:\.\d{0,2})?[sdifFeEgGxXo])")
_ARITHMETIC: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.Pow: operator.pow,
}
_SIGNS: dict[type[ast.unaryop], Callable[[Any], Any]] = {
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
    ast.Not: operator.not_,
}
_COMPARISONS: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Eq: operator.eq,
    ast.NotEq: operator.ne,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Is: operator.is_,
    ast.IsNot: operator.is_not,
    ast.In: lambda one, other: one in other,
    ast.NotIn: lambda one, other: one not in other,
}
_OTHERWISE = "only values, arithmetic, comparisons, conditions, subscripts and the functions that docs/ros.md lists are evaluated"


class Refused(Exception):
    """An expression that is not evaluated; its text is the reason."""


class Exhausted(Refused):
    """An expansion that takes more steps than it may."""


class Work:
    """Steps, of some microseconds each, that one expansion and all expansions of a description may take."""

    SINGLE, TOTAL = 600_000, 20_000_000

    def __init__(self) -> None:
        self._left, self._in_all = 0, self.TOTAL

    def begin(self) -> None:
        """Begin an expansion."""
        self._left = min(self.SINGLE, self._in_all)

    def spend(self, steps: int) -> None:
        """Take steps; raises `Exhausted` when there are no more."""
        self._left -= steps
        self._in_all -= steps
        if self._left < 0:
            raise Exhausted("it takes too many steps")


class DottedDict(dict[Any, Any]):
    """Mapping of a YAML file, whose items are reached by dots too."""


class Namespace(dict[str, Any]):
    """Functions and constants reached by a dot."""


@dataclass(frozen=True, eq=False)
class Function:
    """Function that expressions may call; `keywords`: whether by names of arguments."""

    call: Callable[..., Any]
    keywords: bool = False


Methods = Mapping[tuple[type, str], Callable[..., Any]]
"""Functions that are called as methods of a value of a type."""


class Evaluator:
    """Evaluation of expressions with `methods` of values, within the `work` that is left."""

    def __init__(self, work: Work, methods: Methods) -> None:
        self.work, self.methods = work, methods

    def evaluate(self, text: str, names: Mapping[str, Any]) -> Any:
        """Value of an expression; raises `Refused` where it is none or has what is not evaluated."""
        if len(text) > _LONGEST:
            raise Refused(f"it has more than {_LONGEST} characters")
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                tree = ast.parse(text.strip(), mode="eval")
        except (SyntaxError, ValueError) as problem:
            raise Refused(f"it is no expression ({getattr(problem, 'msg', problem)})") from None
        except (MemoryError, RecursionError):
            raise Refused("it nests too deep") from None
        return self._value(tree.body, names, 0)

    def measured(self, value: Any) -> Any:
        """A value, if it is one that expressions have and not too large; takes steps by its size."""
        items, characters, waiting = 0, 0, [value]
        while waiting:
            item = waiting.pop()
            kind = type(item)
            items += 1
            if kind is str:
                characters += len(item)
            elif kind is int:
                if item.bit_length() > _LARGEST_INTEGER:
                    raise Refused("the number is too large")
            elif kind in (list, tuple):
                items += len(item)
                waiting += item if items <= LARGEST_VALUE else ()
            elif kind in (dict, DottedDict):
                items += len(item)
                waiting += [*item, *item.values()] if items <= LARGEST_VALUE else ()
            elif kind not in _SCALARS:
                raise Refused(f"it makes a {kind.__name__}, which is no value here")
            if items + characters > LARGEST_VALUE:
                raise Refused(f"the value has more than {LARGEST_VALUE} items or characters")
        self.work.spend(items + characters // _CHARACTERS)
        return value

    def _value(self, node: ast.expr, names: Mapping[str, Any], depth: int) -> Any:
        found = self._reached(node, names, depth)
        if isinstance(found, (Function, Namespace)) or type(found) not in (
            *_SCALARS,
            list,
            tuple,
            dict,
            DottedDict,
        ):
            raise Refused(f"'{ast.unparse(node)[:40]}' is no value")
        return found

    def _reached(self, node: ast.expr, names: Mapping[str, Any], depth: int) -> Any:
        """Value, function or namespace that a node means."""
        if depth > _DEEPEST:
            raise Refused("it nests too deep")
        self.work.spend(1)

        def value(part: ast.expr) -> Any:
            return self._value(part, names, depth + 1)

        match node:
            case ast.Constant(value=constant) if type(constant) in _SCALARS:
                return self.measured(constant)
            case ast.Name(id=name):
                return self._named(names, name)
            case ast.List(elts=parts):
                return self.measured([value(part) for part in parts])
            case ast.Tuple(elts=parts):
                return self.measured(tuple(value(part) for part in parts))
            case ast.Dict(keys=keys, values=parts) if None not in keys:
                pairs = [(value(key), value(part)) for key, part in zip(keys, parts, strict=True) if key]
                return self.measured(_called(dict, pairs))
            case ast.UnaryOp(op=sign, operand=part) if type(sign) in _SIGNS:
                operand = value(part)
                if type(sign) is not ast.Not and type(operand) not in _NUMBERS:
                    raise Refused(f"'{ast.unparse(part)[:40]}' is no number")
                return _SIGNS[type(sign)](operand)
            case ast.BinOp(left=left, op=sign, right=right) if type(sign) in _ARITHMETIC:
                return self._arithmetic(type(sign), value(left), value(right))
            case ast.BoolOp(op=sign, values=parts):
                result = value(parts[0])
                for part in parts[1:]:
                    if bool(result) is isinstance(sign, ast.Or):
                        break
                    result = value(part)
                return result
            case ast.IfExp(test=test, body=body, orelse=otherwise):
                return value(body if value(test) else otherwise)
            case ast.Compare(left=left, ops=signs, comparators=parts):
                return self._compared(value(left), signs, [lambda part=part: value(part) for part in parts])
            case ast.Subscript(value=part, slice=ast.Slice(lower=lower, upper=upper, step=step)):
                ends = [None if end is None else value(end) for end in (lower, upper, step)]
                return self.measured(_item(value(part), slice(*ends)))
            case ast.Subscript(value=part, slice=index):
                return _item(value(part), value(index))
            case ast.Attribute(value=part, attr=name):
                owner = self._reached(part, names, depth + 1)
                if _is_namespace(owner):
                    return self._named(owner, name)
                if type(owner) is DottedDict:
                    return _item(owner, name)
                raise Refused(
                    f"'{ast.unparse(part)[:40]}' has no '.{name}' here; dots lead into YAML values only"
                )
            case ast.Call(func=func, args=parts, keywords=keywords) if all(word.arg for word in keywords):
                by_name = {str(word.arg): word.value for word in keywords}
                return self._call(func, parts, by_name, names, depth)
        raise Refused(_OTHERWISE)

    def _named(self, names: Mapping[str, Any], name: str) -> Any:
        try:
            found = names[name]
        except KeyError:
            raise Refused(f"the name '{name}' is not defined") from None
        if type(found) is int:
            self.measured(found)
        return found

    def _call(
        self,
        func: ast.expr,
        parts: list[ast.expr],
        keywords: Mapping[str, ast.expr],
        names: Mapping[str, Any],
        depth: int,
    ) -> Any:
        first: list[Any] = []
        if isinstance(func, ast.Attribute):
            owner = self._reached(func.value, names, depth + 1)
            if _is_namespace(owner):
                target = self._named(owner, func.attr)
            else:
                kind = dict if type(owner) is DottedDict else type(owner)
                method, first = self.methods.get((kind, func.attr)), [owner]
                target = Function(method) if method else None
        else:
            target = self._reached(func, names, depth + 1)
        if not isinstance(target, Function) or (keywords and not target.keywords):
            raise Refused(f"'{ast.unparse(func)[:40]}' is no function that is called so here; {_OTHERWISE}")
        given = [*first, *(self._value(part, names, depth + 1) for part in parts)]
        by_name = {name: self._value(part, names, depth + 1) for name, part in keywords.items()}
        for item in (*given, *by_name.values()):
            self.measured(item)
        return self.measured(_called(target.call, *given, **by_name))

    def _arithmetic(self, sign: type[ast.operator], left: Any, right: Any) -> Any:
        kinds = type(left), type(right)
        if all(kind in _NUMBERS for kind in kinds):
            if (
                sign is ast.Pow
                and float not in kinds
                and (int(left).bit_length() - 1) * right > _LARGEST_INTEGER
            ):
                raise Refused("the number is too large")
        elif sign is ast.Add and kinds[0] is kinds[1] and kinds[0] in _SEQUENCES:
            if len(left) + len(right) > LARGEST_VALUE:
                raise Refused("the value is too large")
        elif sign is ast.Mult and {*kinds} & {int, bool} and {*kinds} & {*_SEQUENCES}:
            text, count = (left, right) if kinds[0] in _SEQUENCES else (right, left)
            if len(text) * count > LARGEST_VALUE:
                raise Refused("the value is too large")
        elif sign is ast.Mod and kinds[0] is str:
            values = right if kinds[1] is tuple else (right,)
            if "%" in _FORMAT.sub("", left) or not all(type(item) in _SCALARS for item in values):
                raise Refused("this formatting is not evaluated")
        else:
            raise Refused(f"there is no such arithmetic of {kinds[0].__name__} and {kinds[1].__name__}")
        return self.measured(_called(_ARITHMETIC[sign], left, right))

    def _compared(self, left: Any, signs: list[ast.cmpop], parts: list[Callable[[], Any]]) -> Any:
        result: Any = True
        for sign, part in zip(signs, parts, strict=True):
            right = part()
            self.measured(left)
            self.measured(right)
            result = _called(_COMPARISONS[type(sign)], left, right)
            if not result:
                break
            left = right
        return result


def _is_namespace(value: Any) -> bool:
    """Whether a value is one of the namespaces here, or one that xacro has made of an include."""
    return isinstance(value, dict) and type(value) not in (dict, DottedDict)


def _item(owner: Any, key: Any) -> Any:
    if type(owner) not in (*_SEQUENCES, dict, DottedDict):
        raise Refused(f"a {type(owner).__name__} has no items")
    item = _called(operator.getitem, owner, key)
    return DottedDict(item) if type(owner) is DottedDict and type(item) is dict else item


def _called(function: Callable[..., Any], *given: Any, **by_name: Any) -> Any:
    """What a function makes of values; `Refused` with the reason where it cannot."""
    try:
        return function(*given, **by_name)
    except KeyError as problem:
        raise Refused(f"there is no {str(problem)[:60]}") from None
    except (TypeError, ValueError, ArithmeticError, LookupError, RecursionError) as problem:
        raise Refused(" ".join(str(problem).split())[:120] or type(problem).__name__) from None
