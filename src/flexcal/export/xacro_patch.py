"""Numbers of a xacro description or URDF replaced where they are written, and an overlay file for those that are written nowhere alone."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from flexcal.errors import FlexcalError
from flexcal.export.wanted_numbers import KEPT, Wanted, is_number, number_text, require_wanted, same_numbers
from flexcal.export.xacro_expansion import ExpandedElement, Expansion, XacroSource
from flexcal.export.xacro_numbers import Makers, Spot, names_in
from flexcal.export.xacro_overlay import Overlay, name_expression
from flexcal.export.xml_text import Edit, SourceElement, XmlText, attribute_text, edited, new_element

_WORD = re.compile(r"(?:\$\{[^}]*\}|\$\([^)]*\)|\S)+")


@dataclass(frozen=True, eq=False)
class PatchedDescription:
    """Content of all files of a description, of which `changes` says what each got; the overlay is among them."""

    contents: Mapping[Path, bytes]
    changes: Mapping[Path, tuple[str, ...]]
    expansion: Expansion


def patched_description(
    source: XacroSource, expansion: Expansion, wanted: Sequence[Wanted]
) -> PatchedDescription:
    """The description with the `wanted` numbers, every other byte of its files as before.

    A number stands in place where it is written as such; where one definition (property, argument, YAML) makes it and nothing else, that
    has another value; all others come from an overlay file by the name of the joint or link. Raises `FlexcalError` where numbers cannot be
    replaced so that nothing else changes.
    """
    patch = _Patch(source, expansion)
    for group in _grouped([item for item in wanted if item.changed]):
        patch.replace(group)
    return patch.finished(wanted)


class _Patch:
    def __init__(self, source: XacroSource, expansion: Expansion) -> None:
        self.source, self.expansion = source, expansion
        self.makers = Makers(expansion, lambda edits: source.expand(edited(expansion.contents, edits)))
        self.copies: dict[tuple[Path, int], list[ExpandedElement]] = {}
        self.number: dict[int, int] = {}
        for k, element in enumerate(expansion.root.walk()):
            self.number[id(element)] = k
            if element.place is not None:
                self.copies.setdefault(element.place, []).append(element)
        self.edits: list[Edit] = []
        self.said: dict[Path, list[str]] = {}
        self.overlay = Overlay(expansion.contents)
        self.texts = _definition_texts(expansion)

    def replace(self, group: Sequence[Wanted]) -> None:
        """Replace the numbers of one element in the sources."""
        first = group[0]
        existing = first.element is not None
        place = first.element.place if first.element is not None else first.parent.place
        if place is None:
            raise FlexcalError(
                "E-ROS-007",
                f"{self.source.path}: <{first.tag}> of {_named(first.owner)} is made by <xacro:element>, where its numbers cannot be "
                "changed; write it as an element, or export urdf instead.",
            )
        source = self.expansion.sources[place[0]]
        element = source.elements[place[1]]
        copies = self.copies[place]
        by_attribute: dict[str | None, dict[int, Wanted]] = {}
        for item in group:
            holder = item.element if existing else item.parent
            by_attribute.setdefault(item.attribute, {})[id(holder)] = item
        if not existing:
            self._create(place[0], source, element, copies, by_attribute)
            return
        for attribute, items in by_attribute.items():
            if not self._in_place(place[0], source, element, copies, attribute, items):
                item = next(iter(items.values()))
                self._write(
                    place[0],
                    element,
                    attribute,
                    self._looked_up(place[0], source, element, copies, items, item),
                )

    def finished(self, wanted: Sequence[Wanted]) -> PatchedDescription:
        """The patched files, after a comparison of their expansion with what was wanted."""
        changed = edited(self.expansion.contents, [*self.edits, *self.overlay.edits()])
        if self.overlay.count:
            changed[self.overlay.path] = self.overlay.content()
            self._say(
                self.overlay.path, f"new: numbers of {self.overlay.count} joints and links, by their names"
            )
        after = self.source.expand(changed)
        require_wanted(self.source.path, self.expansion.root, after.root, wanted)
        contents = {**self.expansion.contents, **changed}
        return PatchedDescription(contents, {path: tuple(said) for path, said in self.said.items()}, after)

    def _in_place(
        self,
        path: Path,
        source: XmlText,
        element: SourceElement,
        copies: Sequence[ExpandedElement],
        attribute: str | None,
        items: Mapping[int, Wanted],
    ) -> bool:
        """Replace numbers where they or their definitions are written; False where that would change something else."""
        item = next(iter(items.values()))
        alike = len(items) == len(copies) and all(
            same_numbers(other.values, item.values) for other in items.values()
        )
        text = _source_text(source, element, attribute)
        if text is None:
            if alike:
                self._write(path, element, attribute, " ".join(number_text(v) for v in item.values))
                self._say(path, f"line {element.line}: {item.key} of {_names(items)}")
            return alike
        start = element.opened if attribute is None else element.attributes[attribute].first
        found = list(_WORD.finditer(text))
        whole = len(found) != len(item.values)
        edits: dict[tuple[Path, int], Edit] = {}
        said: list[tuple[Path, str]] = []
        for copy, own in items.items():
            for k, (new, old) in enumerate(zip(own.values, own.current, strict=True)):
                if abs(new - old) <= KEPT:
                    continue
                if not whole and is_number(found[k].group()):
                    if not alike:
                        return False
                    first, end = (start + len(text[:at].encode()) for at in found[k].span())
                    edits[path, first] = Edit(path, first, end, number_text(new))
                    said.append((path, f"line {element.line}: {item.key} of {_names(items)}"))
                    continue
                spot = Spot(self.number[copy], attribute, k)
                names = names_in(text if whole else found[k].group(), self.texts)
                made = self.makers.edit(spot, old, new, names)
                if made is None:
                    return False
                definition, edit = made
                edits[edit.path, edit.first] = edit
                said.append(
                    (
                        definition.path,
                        f"line {definition.line}: {definition.name}, for {item.key} of {own.name}",
                    )
                )
        self.edits += edits.values()
        for where, sentence in said:
            self._say(where, sentence)
        return True

    def _create(
        self,
        path: Path,
        source: XmlText,
        element: SourceElement,
        copies: Sequence[ExpandedElement],
        by_attribute: Mapping[str | None, Mapping[int, Wanted]],
    ) -> None:
        attributes: dict[str, str] = {}
        text, tag = "", ""
        for attribute, items in by_attribute.items():
            item = next(iter(items.values()))
            tag = item.tag
            attributes |= dict(item.fixed)
            alike = len(items) == len(copies) and all(
                same_numbers(o.values, item.values) for o in items.values()
            )
            value = (
                " ".join(number_text(v) for v in item.values)
                if alike
                else self._looked_up(path, source, element, copies, items, item)
            )
            if attribute is None:
                text = value
            else:
                attributes[attribute] = value
        line = new_element(tag, attributes, text)
        self.edits.append(Edit(path, element.opened, element.opened, source.indent(element) + line))
        owners = dict.fromkeys(_named(i.owner) for items in by_attribute.values() for i in items.values())
        self._say(path, f"line {element.line}: <{tag}> added to {', '.join(owners)}")

    def _looked_up(
        self,
        path: Path,
        source: XmlText,
        element: SourceElement,
        copies: Sequence[ExpandedElement],
        items: Mapping[int, Wanted],
        item: Wanted,
    ) -> str:
        """Expression that takes the numbers from the overlay, which gets them for every copy of the element."""
        owners = [_owner(copy) for copy in copies]
        if any(owner is None or owner.tag != item.owner.tag for owner in owners):
            raise FlexcalError(
                "E-ROS-008",
                f"{source.where(element)}: the numbers of {_named(item.owner)} stand in an element that other things than joints and links "
                "have too; write an element for each, or export urdf instead.",
            )
        if len(copies) == 1:
            key = repr(item.owner.attributes["name"])
        else:
            around = element
            while around.tag != item.owner.tag and around.parent is not None:
                around = around.parent
            name = around.attributes.get("name")
            written = None if name is None else name_expression(name.value)
            if written is None:
                named = ", ".join(dict.fromkeys(_named(owner) for owner in owners if owner is not None))
                raise FlexcalError(
                    "E-ROS-009",
                    f"{source.where(element)}: one element has the numbers of {named}, which differ now; write it inside the "
                    f"{item.owner.tag}, or export urdf instead.",
                )
            key = written
        for copy, owner in zip(copies, owners, strict=True):
            assert owner is not None
            own = items.get(id(copy))
            current = copy.attributes.get(item.attribute, "") if item.attribute else copy.text
            value = (
                current or " ".join(number_text(v) for v in item.usual)
                if own is None
                else " ".join(number_text(v) for v in own.values)
            )
            self.overlay.add(owner.tag, owner.attributes["name"], item.key, value)
        self._say(
            path, f"line {element.line}: {item.key} of {_names(items)} comes from {self.overlay.path.name}"
        )
        return self.overlay.expression(path, source, item.owner.tag, key, item.key)

    def _write(self, path: Path, element: SourceElement, attribute: str | None, value: str) -> None:
        if attribute is None:
            self.edits.append(Edit(path, element.opened, element.closed, attribute_text(value)))
        elif attribute in element.attributes:
            place = element.attributes[attribute]
            self.edits.append(Edit(path, place.first - 1, place.end + 1, f'"{attribute_text(value)}"'))
        else:
            self.edits.append(
                Edit(path, element.attributed, element.attributed, f' {attribute}="{attribute_text(value)}"')
            )

    def _say(self, path: Path, sentence: str) -> None:
        said = self.said.setdefault(path, [])
        if sentence not in said:
            said.append(sentence)


def _grouped(wanted: Sequence[Wanted]) -> list[list[Wanted]]:
    """Those of the same element of the sources together."""
    groups: dict[object, list[Wanted]] = {}
    for item in wanted:
        if item.element is not None:
            key: object = (item.element.place, item.attribute)
        else:
            key = (item.parent.place, item.tag, item.fixed)
        groups.setdefault(key, []).append(item)
    return list(groups.values())


def _source_text(source: XmlText, element: SourceElement, attribute: str | None) -> str | None:
    if attribute is None:
        return source.content[element.opened : element.closed].decode()
    place = element.attributes.get(attribute)
    return None if place is None else source.content[place.first : place.end].decode()


def _definition_texts(expansion: Expansion) -> dict[str, str]:
    texts: dict[str, str] = {}
    for source in expansion.sources.values():
        for element in source.elements:
            if not element.tag.startswith("xacro:"):
                continue
            for attribute, place in element.attributes.items():
                name = (
                    element.attributes["name"].value
                    if attribute in ("value", "default") and "name" in element.attributes
                    else attribute
                )
                texts[name] = f"{texts.get(name, '')} {place.value}"
    return texts


def _owner(element: ExpandedElement) -> ExpandedElement | None:
    """The joint or link of the description in which an element stands."""
    at: ExpandedElement | None = element
    while at is not None and not (
        at.tag in ("joint", "link") and at.parent is not None and "name" in at.attributes
    ):
        at = at.parent
    if at is None or any(above.tag in ("visual", "collision") for above in _between(element, at)):
        return None
    return at


def _between(element: ExpandedElement, owner: ExpandedElement) -> list[ExpandedElement]:
    found, at = [], element
    while at is not owner and at.parent is not None:
        found.append(at)
        at = at.parent
    return found


def _names(items: Mapping[int, Wanted]) -> str:
    return ", ".join(dict.fromkeys(item.name for item in items.values()))


def _named(element: ExpandedElement) -> str:
    return element.attributes["name"]
