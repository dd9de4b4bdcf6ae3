"""Values of a YAML text with the places where they begin and end."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from flexcal.files.structuring import Keys

if TYPE_CHECKING:
    from collections.abc import Iterator

    from yaml import Event, Mark


@dataclass(frozen=True)
class Place:
    """Place in a text: `index` of the character from 0, `line` and `column` from 1."""

    index: int
    line: int
    column: int


@dataclass(frozen=True, eq=False)
class Node:
    """Value of a YAML text from `start` to `end`, an index; a block collection ends where its last value does.

    `flow`: written with brackets, or a scalar. `block_text`: a scalar after | or >. `items` are the values of a list, or of a mapping with
    their `keys` and places. An alias is a scalar.
    """

    start: Place
    end: int
    kind: str
    flow: bool
    block_text: bool
    keys: tuple[tuple[str, Place], ...]
    items: tuple[Node, ...]

    @property
    def entries(self) -> dict[str | int, Node]:
        """Values by key or number."""
        if self.kind == "mapping":
            return {key[0]: item for key, item in zip(self.keys, self.items, strict=True)}
        return dict(enumerate(self.items))

    def at(self, keys: Keys) -> Node | None:
        """Value that `keys` lead to, None where there is none."""
        node: Node | None = self
        for key in keys:
            node = None if node is None else node.entries.get(key)
        return node

    def places(self, keys: Keys = ()) -> dict[Keys, Place]:
        """Places of all keys, of list items, and of the whole, `()`."""
        found = {keys: self.start}
        for key, item in self.entries.items():
            found |= item.places((*keys, key))
        for name, place in self.keys:
            found[(*keys, name)] = place
        return found


def yaml_nodes(text: str) -> Node:
    """The one document of a text that `flexcal.files.formats.read_yaml_file` accepts; raises what PyYAML does for another."""
    import yaml

    events = yaml.parse(text, Loader=yaml.CSafeLoader)
    for _ in range(2):  # the starts of stream and document
        next(events)
    return _node(events, next(events))


def _node(events: Iterator[Event], event: Any) -> Node:
    import yaml

    start = _place(event.start_mark)
    if isinstance(event, (yaml.ScalarEvent, yaml.AliasEvent)):
        style = getattr(event, "style", None)
        return Node(start, event.end_mark.index, "scalar", True, style in ("|", ">"), (), ())
    mapping, end = isinstance(event, yaml.MappingStartEvent), start.index
    keys: list[tuple[str, Place]] = []
    items: list[Node] = []
    while not isinstance(inner := next(events), yaml.CollectionEndEvent):
        if mapping:
            keys.append((str(inner.value), _place(inner.start_mark)))  # type: ignore[attr-defined]
            inner = next(events)
        items.append(_node(events, inner))
    end = inner.end_mark.index if event.flow_style else items[-1].end
    kind = "mapping" if mapping else "list"
    return Node(start, end, kind, bool(event.flow_style), False, tuple(keys), tuple(items))


def _place(mark: Mark) -> Place:
    return Place(mark.index, mark.line + 1, mark.column + 1)
