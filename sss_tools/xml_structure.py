"""What an XML mesh file (dae, and the models in 3mf) will unfold to, found before a tree is built of it.

Document types are refused: no mesh needs one, and entities in them multiply text or name other files. Everything
here raises ValueError, with the rest of a sentence about the file.
"""

from __future__ import annotations

import io
import zipfile
from collections import defaultdict
from collections.abc import Callable
from xml.parsers import expat

from . import unfolding

Attributes = dict[str, str]

_BYTES_A_CHARACTER = 36
"""Of an index list: at least two characters a corner, which becomes a position, a normal, a texture coordinate and an
index."""


class _Done(Exception):
    """The part of a document that was asked for is read."""


def check_prolog(data: bytes) -> None:
    """Refuse a document type, and what is no XML up to its first element."""

    def start(name: str, attributes: Attributes) -> None:
        raise _Done

    try:
        _parse(data, start)
    except _Done:
        return


def _parse(
    data: bytes,
    start: Callable[[str, Attributes], None],
    end: Callable[[str], None] | None = None,
    text: Callable[[str], None] | None = None,
) -> None:
    """Call the functions with what is found; names come without their namespaces."""

    def refuse(*_: object) -> None:
        raise ValueError("it has a document type, which may hold anything but a mesh")

    def local(name: str) -> str:
        return name.rpartition(" ")[2]

    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartDoctypeDeclHandler = refuse
    parser.StartElementHandler = lambda name, attributes: start(
        local(name), {local(key): value for key, value in attributes.items()}
    )
    if end is not None:
        parser.EndElementHandler = lambda name: end(local(name))
    if text is not None:
        parser.buffer_text = True
        parser.CharacterDataHandler = text
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise ValueError(f"it does not parse as XML ({error})") from None


def check_collada(data: bytes) -> None:
    """Refuse a dae file with a document type, too deep a tree, or nodes that unfold to too much.

    Also what is a zip archive at the same time: a reader would look into that instead.
    """
    if zipfile.is_zipfile(io.BytesIO(data)):
        raise ValueError("it is an archive: unpack it")
    graph = _ColladaGraph()
    _parse(data, graph.start, graph.end, graph.text)
    weight = unfolding.check_tree([graph.ROOT], graph.children.__getitem__, graph.weight.__getitem__)
    unfolding.check_geometry(weight, len(data))


class _ColladaGraph:
    """Which nodes hold or name which, and how much geometry each names.

    Keys are ids, and numbers for elements without one. Elements that are no node, geometry or controller are passed
    through: what they hold belongs to what holds them. Libraries are held by nothing.
    """

    ROOT = "visual scenes"
    _HOLDERS = ("node", "geometry", "controller")

    def __init__(self) -> None:
        self.children: dict[object, list[object]] = defaultdict(list)
        self.weight: dict[object, int] = defaultdict(int)
        self._open: list[str] = []
        self._holders: list[object] = []

    def start(self, name: str, attributes: Attributes) -> None:
        self._open.append(name)
        if len(self._open) > unfolding.MOST_LEVELS:
            raise ValueError(f"its elements are nested more than {unfolding.MOST_LEVELS} deep")
        if name in self._HOLDERS:
            key = f"#{attributes['id']}" if "id" in attributes else object()
            holder = self._holders[-1] if self._holders else self.ROOT if "visual_scene" in self._open else None
            if name == "node" and holder is not None:
                self.children[holder].append(key)
            self._holders.append(key)
        elif name.startswith("instance_") and "url" in attributes and self._holders:
            self.children[self._holders[-1]].append(attributes["url"])
        elif name in ("skin", "morph") and "source" in attributes and self._holders:
            self.children[self._holders[-1]].append(attributes["source"])

    def end(self, name: str) -> None:
        self._open.pop()
        if name in self._HOLDERS:
            self._holders.pop()

    def text(self, characters: str) -> None:
        if self._open[-1] == "p" and self._holders:
            self.weight[self._holders[-1]] += _BYTES_A_CHARACTER * len(characters)


def check_archive(data: bytes) -> None:
    """Refuse a 3mf file whose members, or whose components, unfold to too much."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        members = archive.infolist()
        unfolding.check_text(sum(member.file_size for member in members), len(data))
        models = [member for member in members if member.filename.lower().endswith(".model")]
        sizes = {member.filename: member.file_size for member in members}
        for member in models:
            with archive.open(member) as file:
                content = file.read()
            check_prolog(content)
            # UTF-16 would hide the word
            if b"component" in content or b"\0" in content[:64]:
                _check_components(content, sizes, len(data))


def _check_components(model: bytes, sizes: dict[str, int], size: int) -> None:
    children: dict[object, list[object]] = defaultdict(list)
    current: list[str] = [""]
    # a reader parses the file that a component names once a component
    named = 0

    def start(name: str, attributes: Attributes) -> None:
        nonlocal named
        if name == "object":
            current[0] = attributes.get("id", "")
        elif name == "component":
            children[current[0]].append(attributes.get("objectid", ""))
            named += sizes.get(attributes.get("path", "").strip("/"), 0)
        elif name == "item":
            children[None].append(attributes.get("objectid", ""))

    _parse(model, start)
    unfolding.check_text(named, size)
    unfolding.check_tree([None], children.__getitem__)
