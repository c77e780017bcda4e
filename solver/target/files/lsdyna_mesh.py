"""Meshes from LS-DYNA's keyword files: *NODE, *ELEMENT_SHELL, the headings of *PART, and *SET_NODE."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from birdstrike.data.errors import UserError
from birdstrike.solver.target.files.text_mesh import Files, Shell, TextMesh, decimal, is_zero, lines_of, whole

ENDINGS = (".k", ".key", ".dyn")
"""Of the files that are read as keyword files."""
LONG = 20
"""Width of every field in the long format."""
WITH_LINE = ("THICKNESS", "BETA", "MCID")
"""Options of *ELEMENT_SHELL that give each shell one more line, however many of them stand."""
PART_OPTIONS = ("INERTIA", "REPOSITION", "CONTACT", "PRINT", "ATTACHMENT", "COMPOSITE")
"""Options of *PART whose first two lines are heading and number, as without one."""
MOVED = ("NODE_TRANSFORM", "NODE_MERGE", "PART_MOVE", "INCLUDE_")
"""How keywords begin that move nodes or bring them."""
JOINED = ("CONSTRAINED_", "CONTACT_TIED", "CONTACT_SPOTWELD", "ELEMENT_")
"""How keywords begin that hold nodes together, load them with mass, or are elements."""
FOLDERS = ("INCLUDE_PATH", "INCLUDE_PATH_RELATIVE")
"""Keywords that name folders of included files."""
UNHEARD = ("ELEMENT_PLOTEL", "CONSTRAINED_GLOBAL", *FOLDERS)
"""Of these such that change nothing of the target."""
HELD = ("BOUNDARY_SPC_NODE", "BOUNDARY_SPC_NODE_ID")
"""Those that hold nodes one by one, not by a set."""
LIST = "write them as a *SET_NODE_LIST"
"""The remedy for nodes that are held otherwise."""
PARAMETERS = ("PARAMETER", "PARAMETER_LOCAL", "PARAMETER_MUTABLE")
"""Keywords that give values names; an expression's is not worked out."""


class Block(NamedTuple):
    """Keyword in capitals without its star, whether its fields are long, and its lines without comments.

    parameters: of the whole file, name in capitals -> its value's text.
    """

    keyword: str
    long: bool
    lines: list[str]
    parameters: dict[str, str]

    def fields(self, line: str, widths: Sequence[int]) -> list[str]:
        """Fields of a line: between commas, or of fixed widths; in place of &name the parameter's value."""
        if "," in line:
            found = [word.strip() for word in line.split(",")]
            found = (found + [""] * len(widths))[: len(widths)]
        else:
            found, at = list[str](), 0
            for width in widths:
                width = LONG if self.long else width
                found.append(line[at : at + width].strip())
                at += width
        return [self._value(text, line) if "&" in text else text for text in found]

    def _value(self, text: str, line: str) -> str:
        """What &name or -&name stands for; raises UserError for a name that no *PARAMETER gives."""
        sign, _, name = text.rpartition("&")
        value = self.parameters.get(name.strip().upper())
        if value is None or sign.strip() not in ("", "+", "-"):
            raise UserError(
                f'*{self.keyword}: "{text}" in the line "{line.strip()}" is no parameter of the file; its parameters '
                f"(R and I of *PARAMETER): {', '.join(self.parameters) or 'none'}. Give it there by a number, which an "
                "expression is not, or write the number into the line"
            )
        return value if sign.strip() != "-" else value[1:] if value.startswith("-") else f"-{value.lstrip('+')}"

    def number(self, text: str, line: str) -> int:
        """A whole number, 0 where nothing stands."""
        return whole(text, line, f"*{self.keyword}") if text else 0


def read_keywords(path: str) -> TextMesh:
    """A keyword file with all that it includes.

    A part or a set is called by its heading or title, by heading and number where several have the same, and without
    one part_<number> or set_<number>. Raises UserError for a file that is no mesh of shells.
    """
    files, parameters = Files(Path(path)), dict[str, str]()
    mesh, blocks = TextMesh(files=files.found), list(_blocks(files.first, files, parameters))
    for block in blocks:
        if block.keyword in PARAMETERS:
            _parameters(block)
    headed, thick = dict[int, tuple[str, int]](), dict[int, float]()
    for block in blocks:
        if block.keyword == "NODE":
            _nodes(block, mesh)
        elif block.keyword.startswith("ELEMENT_SHELL"):
            _shells(block, mesh)
        elif block.keyword.partition("_")[0] == "PART":
            headed |= _parts(block)
        elif block.keyword in ("SECTION_SHELL", "SECTION_SHELL_TITLE"):
            thick |= _thickness(block)
    if not mesh.places or not mesh.shells:
        missing = "*NODE" if not mesh.places else "*ELEMENT_SHELL"
        raise UserError(f"it holds no {missing}; write nodes and shells into the one file, or include them")
    headings, parts = {pid: heading for pid, (heading, _) in headed.items()}, dict[int, list[int]]()
    for i, shell in enumerate(mesh.shells):
        parts.setdefault(shell.part or 0, []).append(i)
    mesh.shell_sets = {_called("part", pid, headings): parts[pid] for pid in sorted(parts)}
    mesh.thicknesses = {
        _called("part", pid, headings): thick[section]
        for pid, (_, section) in headed.items()
        if pid in parts and section in thick
    }
    mesh.shells = [shell._replace(part=None) for shell in mesh.shells]  # the sets say it
    _node_sets([block for block in blocks if block.keyword.startswith("SET_NODE")], mesh, parts)
    _left_out(blocks, mesh)
    return mesh


def _parameters(block: Block) -> None:
    """Names and values of *PARAMETER, four on a line, as "R dx" or "Idx", join those of the file."""
    for line in filter(str.strip, block.lines):
        words = block.fields(line, (10,) * 8)
        for word, value in zip(words[::2], words[1::2], strict=True):
            name = word[1:].strip().upper()
            if word[:1].upper() not in ("R", "I") or not name:
                if word[:1].upper() == "C" or not word:
                    continue
                raise UserError(f'*{block.keyword}: "{word}" in the line "{line.strip()}" is no R or I with a name')
            (decimal if word[0] in "Rr" else whole)(value, line, f"*{block.keyword}")
            if block.parameters.setdefault(name, value) != value:
                raise UserError(
                    f"*{block.keyword}: {name} is given twice, as {block.parameters[name]} and as {value}; leave one "
                    "out, or give each a name of its own"
                )


def _blocks(
    path: Path, files: Files, parameters: dict[str, str], long: bool = False, depth: int = 0
) -> Iterator[Block]:
    """A file's blocks up to *END, those of included files in their place."""
    block = Block("", long, [], parameters)
    for line in [*lines_of(path), "*END"]:
        if not line.startswith("*"):
            if not line.startswith("$"):
                block.lines.append(line)
            continue
        if block.keyword == "INCLUDE":
            for name in _names_of_files(block.lines):
                yield from _blocks(files.included(name, path, depth + 1), files, parameters, long, depth + 1)
        elif block.keyword:
            files.folders += _folders(block, path)
            yield block
        keyword, *words = line[1:].upper().split() or [""]
        if keyword == "END":
            return
        if keyword == "KEYWORD":
            said = "".join(words)
            long = "LONG=Y" in said or (long and "LONG=" not in said)
        if "%" in words or keyword.endswith("%"):
            raise UserError(f"*{keyword} is in the I10 format (%), which is not read; write it in the standard format")
        sign = {keyword[-1:], *words}
        own = "+" in sign or (long and "-" not in sign)
        block = Block(keyword.rstrip("+-"), own, [], parameters)


def _folders(block: Block, path: Path) -> list[Path]:
    """Where files that are included later may stand; path: the file that says so."""
    return [path.parent / name for name in _names_of_files(block.lines)] if block.keyword in FOLDERS else []


def _names_of_files(lines: list[str]) -> Iterator[str]:
    """Of *INCLUDE; a name that ends in " +" goes on in the next line."""
    name = ""
    for line in lines:
        name += line.strip().removesuffix(" +")
        if name and not line.rstrip().endswith(" +"):
            yield name
            name = ""


def _nodes(block: Block, mesh: TextMesh) -> None:
    held = 0
    for line in filter(str.strip, block.lines):
        number, *place, moved, turned = block.fields(line, (8, 16, 16, 16, 8, 8))
        x, y, z = (decimal(text, line, "*NODE") for text in place)
        mesh.add_node(whole(number, line, "*NODE"), (x, y, z))
        held += not (is_zero(moved) and is_zero(turned))
    if held:
        mesh.told.append(f"TC and RC of *NODE are not read: no set is made of the {held} nodes that they hold; {LIST}")


def _shells(block: Block, mesh: TextMesh) -> None:
    """Shells of a block; n4 equal to n3, or 0, makes a triangle."""
    options = [word for word in block.keyword.split("_")[2:] if word]
    unknown = [word for word in options if word not in (*WITH_LINE, "OFFSET", "DOF")]
    if unknown:
        raise UserError(f"*{block.keyword} is not read; write its shells as *ELEMENT_SHELL")
    each = 1 + any(word in WITH_LINE for word in options) + ("OFFSET" in options) + ("DOF" in options)
    lines = list(_own_lines(block, each))
    for line in lines:
        eid, pid, *nodes = (block.number(text, line) for text in block.fields(line, (8,) * 10))
        if any(nodes[4:]):
            raise UserError(
                f"shell {eid} has nodes at mid-side; a target is of shells of first order, mesh it with those"
            )
        if nodes[3] in (0, nodes[2]):
            nodes = nodes[:3]
        mesh.shells.append(Shell(eid, tuple(nodes[:4]), pid))
    for word, what in (("THICKNESS", "thicknesses are those of target.parts"), ("OFFSET", "shells lie in their nodes")):
        if word in options and lines:
            mesh.told.append(f"{word} of *{block.keyword} is not read: {what}")


def _own_lines(block: Block, each: int) -> Iterator[str]:
    """The first of `each` lines of every shell; those behind it may be blank, as their values have defaults."""
    lines, at = block.lines, 0
    while at < len(lines):
        if not lines[at].strip():
            at += 1
            continue
        if at + each > len(lines):
            raise UserError(
                f"*{block.keyword} has {len(lines)} lines, of {each} for each shell; is the file cut short?"
            )
        yield lines[at]
        at += each


def _parts(block: Block) -> dict[int, tuple[str, int]]:
    """Heading and number of the section of each part by its number; a composite has the section 0."""
    options = block.keyword.split("_")[1:]
    if options and options[0] not in PART_OPTIONS:
        return {}
    lines = block.lines[:2] if options else block.lines
    found: dict[int, tuple[str, int]] = {}
    for heading, line in zip(lines[::2], lines[1::2], strict=False):
        pid, section = block.fields(line, (10, 10))
        number = 0 if "COMPOSITE" in options else block.number(section, line)
        found[block.number(pid, line)] = "_".join(heading.split()), number
    return found


def _thickness(block: Block) -> dict[int, float]:
    """T1 of a section by its number, the first of a block: how many lines others have hangs on their options."""
    lines = [line for line in block.lines if line.strip()][block.keyword.endswith("TITLE") :][:2]
    if len(lines) < 2:
        return {}
    number, own = (block.fields(line, (10,))[0] for line in lines)
    value = decimal(own, lines[1], f"*{block.keyword}")
    return {block.number(number, lines[0]): value} if value else {}


def _called(kind: str, number: int, titles: dict[int, str]) -> str:
    """A name of its own for every part or set."""
    title = titles.get(number, "")
    if not title:
        return f"{kind}_{number}"
    return title if Counter(titles.values())[title] == 1 else f"{title}_{number}"


def _node_sets(blocks: list[Block], mesh: TextMesh, parts: dict[int, list[int]]) -> None:
    """Fill in the sets of nodes."""
    titles, sets, sums = dict[int, str](), dict[int, list[int]](), dict[int, list[int]]()
    for block in blocks:
        options = set(block.keyword.split("_")[2:])
        lines = list(block.lines)
        title = "_".join(lines.pop(0).split()) if "TITLE" in options and lines else ""
        lines = [line for line in lines if line.strip()]
        if not lines:
            continue
        sid = block.number(block.fields(lines[0], (10,))[0], lines[0])
        if sid in titles and "COLLECT" not in options:
            raise UserError(f"*{block.keyword}: the set {sid} is given twice; give each a number of its own")
        titles[sid] = titles.get(sid) or title
        found = _listed(block, options, lines[1:], mesh, parts)
        if found is None:
            mesh.told.append(f"*{block.keyword} is not read: there is no {_called('set', sid, titles)} of its nodes")
            continue
        (sums if "ADD" in options else sets).setdefault(sid, []).extend(found)
    for sid in sums:
        sets[sid] = sets.get(sid, []) + list(_summed(sid, sums, sets, titles))
    mesh.node_sets = {_called("set", sid, titles): sets[sid] for sid in sets}


def _summed(
    sid: int, sums: dict[int, list[int]], sets: dict[int, list[int]], titles: dict[int, str], depth: int = 0
) -> Iterator[int]:
    """Nodes of the sets that a set adds up, wherever these stand and whatever they add up themselves."""
    for one in sums[sid]:
        if depth > len(sums):
            raise UserError(f"the set {_called('set', sid, titles)} adds itself up; leave it out of its own sum")
        yield from sets.get(one, ())
        if one in sums:
            yield from _summed(one, sums, sets, titles, depth + 1)
        elif one not in sets:
            raise UserError(
                f"the set {_called('set', sid, titles)} adds the set {one}, which is not there or not read; list its "
                "nodes instead"
            )


def _listed(
    block: Block, options: set[str], lines: list[str], mesh: TextMesh, parts: dict[int, list[int]]
) -> list[int] | None:
    """Nodes of a set, or the sets that it adds up; None where its way of naming them is not read."""
    kind = options - {"LIST", "TITLE", "COLLECT"}
    if kind == {"GENERAL"}:
        return _general(block, lines, mesh, parts)
    if kind == {"COLUMN"}:
        return [block.number(block.fields(line, (10,))[0], line) for line in lines]
    if kind not in (set(), {"ADD"}, {"GENERATE"}, {"GENERATE", "INCREMENT"}):
        return None
    if more := [line for line in lines if any(map(str.strip, line.split(",")[8:]))]:
        raise UserError(f'*{block.keyword}: the line "{more[0].strip()}" has more than 8 numbers; begin new lines')
    rows = [[block.number(text, line) for text in block.fields(line, (10,) * 8)] for line in lines]
    if "GENERATE" not in kind:
        return [number for row in rows for number in row if number]
    if "INCREMENT" in kind:
        ranges = [range(row[0], row[1] + 1, max(row[2], 1)) for row in rows]
    else:
        ranges = [range(row[i], row[i + 1] + 1) for row in rows for i in range(0, 8, 2) if row[i]]
    return [node for node in mesh.places if any(node in one for one in ranges)]


def _general(block: Block, lines: list[str], mesh: TextMesh, parts: dict[int, list[int]]) -> list[int] | None:
    """Nodes of a set of *SET_NODE_GENERAL: single ones, of parts, or all."""
    found: dict[int, None] = {}
    for line in lines:
        option, *rest = block.fields(line, (10,) * 8)
        if option.upper() not in ("NODE", "DNODE", "PART", "ALL"):
            return None
        numbers = [block.number(text, line) for text in rest if text and option.upper() != "ALL"]
        numbers = [number for number in numbers if number]
        if option.upper() == "PART":
            numbers = [n for pid in numbers for i in parts.get(pid, ()) for n in mesh.shells[i].nodes]
        if option.upper() == "DNODE":
            found = {node: None for node in found if node not in numbers}
        else:
            found |= dict.fromkeys(mesh.places if option.upper() == "ALL" else numbers)
    return list(found)


def _left_out(blocks: list[Block], mesh: TextMesh) -> None:
    """Note what changes the answer and is not read."""
    keywords = sorted({block.keyword for block in blocks if not block.keyword.startswith(UNHEARD)})
    mesh.held += [f"*{word}" for word in keywords if word.startswith(JOINED) and not word.startswith("ELEMENT_SHELL")]
    moved = [f"*{word}" for word in keywords if word.startswith(MOVED)]
    if moved:
        mesh.told.append(
            f"{', '.join(moved)} is not read: nodes stay where they are written, and what it brings is not there"
        )
    if single := [f"*{word}" for word in keywords if word in HELD]:
        mesh.told.append(f"{', '.join(single)} is not read: no set is made of the nodes that it holds; {LIST}")
    if any(_off_middle(block) for block in blocks if block.keyword.startswith("SECTION_SHELL")):
        mesh.told.append("NLOC of *SECTION_SHELL is not read: shells are taken to lie in their nodes")


def _off_middle(block: Block) -> bool:
    """Whether a block's first section has its shells beside their nodes: NLOC, the fifth field of its second line."""
    second = 2 if block.keyword.endswith("_TITLE") else 1
    return any(not is_zero(block.fields(line, (10,) * 5)[4]) for line in block.lines[second : second + 1])
