"""Changes to an XML file that leave all its other bytes as they are."""

import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from xml.parsers import expat

from drake_disasm.common.errors import DisasmError

_DEEPEST = 64  # elements in elements: no robot's file has more


_PREFIX = re.compile(r"(</?[A-Za-z]\w*):")


def parsed(text: str) -> ElementTree.Element:
    """Returns the elements of an XML text, `drake:rotor_inertia` as `drake_rotor_...`.

    Robots' files often do not declare the prefixes that they use.
    """
    body = re.sub(r"^\s*<\?xml.*?\?>", "", text, flags=re.S)
    return ElementTree.fromstring(_PREFIX.sub(r"\1_", body))


@dataclass
class Element:
    """An element, and where it is in the file.

    Attributes:
        tag: its name, with the prefix.
        attributes: by name.
        start, head_end: of its first tag, in bytes.
        end: of the element.
        children: in their order.
    """

    tag: str
    attributes: dict[str, str]
    start: int
    head_end: int = 0
    end: int = 0
    children: list["Element"] = field(default_factory=list)

    def all(self, tag: str) -> list["Element"]:
        """Returns the children with a tag."""
        return [child for child in self.children if child.tag == tag]

    def first(self, tag: str) -> "Element | None":
        """Returns the first child with a tag; None if there is none."""
        return next(iter(self.all(tag)), None)

    def walk(self) -> Iterator["Element"]:
        """Yields the element and all in it."""
        yield self
        for child in self.children:
            yield from child.walk()


class XmlEdits:
    """Changes to an XML file, made at once at the end.

    Attributes:
        root: the outermost element, as it is before all changes.

    Args:
        data: the file.
        name: of the file, for messages.

    Raises:
        DisasmError: it is no XML, or not in an encoding that has ASCII's bytes.
    """

    def __init__(self, data: bytes, name: str) -> None:
        self._data, self._edits = data, list[tuple[int, int, bytes]]()
        self._line = b"\r\n" if b"\r\n" in data else b"\n"
        if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
            raise DisasmError(f"{name}: is in UTF-16; save it in UTF-8")
        try:
            self.root = _Reader(data).root
        except (expat.ExpatError, IndexError, ValueError) as error:
            raise DisasmError(f"{name}: is no XML ({error}); give a URDF") from None

    def set_attributes(self, element: Element, values: Mapping[str, str]) -> None:
        """Sets attributes of an element; those that it lacks are added behind."""
        head = self._data[element.start : element.head_end]
        added = b""
        for name, value in values.items():
            pattern = (
                rb"(\s" + re.escape(name.encode()) + rb"\s*=\s*)(\"[^\"]*\"|'[^']*')"
            )
            match = re.search(pattern, head)
            if match:
                at = element.start + match.start(2)
                end = element.start + match.end(2)
                self._edits.append((at, end, f'"{value}"'.encode()))
            else:
                added += f' {name}="{value}"'.encode()
        if added:
            inner = head[: -2 if head.endswith(b"/>") else -1].rstrip()
            at = element.start + len(inner)
            self._edits.append((at, at, added))

    def add_child(self, parent: Element, text: str, first: bool = False) -> None:
        """Adds lines to an element, before its end, or as the first of its children.

        Args:
            parent: the element.
            text: lines, indented from zero on.
            first: whether they come before all other children.
        """
        margin = self._indentation(parent.start)
        inner = margin + b"  "
        if parent.children:
            inner = self._indentation(parent.children[0].start) or inner
        lines = self._line.join(inner + each.encode() for each in text.splitlines())
        head = self._data[parent.start : parent.head_end]
        if head.endswith(b"/>"):
            at = parent.head_end - 2
            tail = b"</" + parent.tag.encode() + b">"
            text_bytes = b">" + self._line + lines + self._line + margin + tail
            self._edits.append((at, parent.head_end, text_bytes))
        elif first:
            at = parent.head_end
            self._edits.append((at, at, self._line + lines))
        else:
            close = self._data.rindex(b"</", parent.start, parent.end)
            last = self._data.rindex(b"\n", 0, close) + 1 if b"\n" in self._data else 0
            is_alone = last and not self._data[last:close].strip()
            at = last if is_alone else close
            before = b"" if is_alone else self._line
            self._edits.append((at, at, before + lines + self._line))

    def result(self) -> bytes:
        """Returns the file with all changes."""
        parts, done = [], 0
        for start, end, text in sorted(self._edits, key=lambda edit: edit[0]):
            parts += [self._data[done:start], text]
            done = end
        return b"".join([*parts, self._data[done:]])

    def _indentation(self, at: int) -> bytes:
        """Returns the blanks before a byte, if they are all that its line has."""
        before = self._data[self._data.rfind(b"\n", 0, at) + 1 : at]
        return before if not before.strip() else b""


class _Reader:
    """Reads the elements of a file, with their places."""

    def __init__(self, data: bytes) -> None:
        self._data, self._open = data, list[Element]()
        self._root: Element | None = None
        self._parser = expat.ParserCreate()
        self._parser.StartElementHandler = self._started
        self._parser.EndElementHandler = self._ended
        self._parser.Parse(data, True)

    @property
    def root(self) -> Element:
        """The outermost element."""
        if self._root is None:
            raise ValueError("it has no element")
        return self._root

    def _started(self, tag: str, attributes: dict[str, str]) -> None:
        start = self._parser.CurrentByteIndex
        element = Element(tag, attributes, start, _tag_end(self._data, start))
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)
        if len(self._open) > _DEEPEST:
            raise ValueError(f"elements are nested more than {_DEEPEST} deep")

    def _ended(self, tag: str) -> None:
        element = self._open.pop()
        at = self._parser.CurrentByteIndex
        is_empty = self._data[element.head_end - 2 : element.head_end] == b"/>"
        element.end = element.head_end if is_empty else _tag_end(self._data, at)


def _tag_end(data: bytes, start: int) -> int:
    """Returns where a tag ends: behind the first > that is in no quotes."""
    match = re.compile(rb"<(?:[^>\"']|\"[^\"]*\"|'[^']*')*>").match(data, start)
    if match is None:
        raise ValueError(f"a tag at byte {start} has no end")
    return match.end()
