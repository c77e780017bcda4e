"""Reading a page back as a browser would: what it refers to, its tables, headings and figures."""

from __future__ import annotations

from html.parser import HTMLParser

REFERENCES = ("src", "href", "xlink:href", "srcset", "data", "action", "poster")


class Page(HTMLParser):
    """A parsed page.

    references: every address in an attribute; tables: caption -> rows of cells; text: tag -> texts; figures: id ->
    count of drawn elements; pictures: id -> the PNG's address; ids: all of them.
    """

    def __init__(self, text: str) -> None:
        super().__init__()
        self.references: list[str] = []
        self.tables: dict[str, list[list[str]]] = {}
        self.text: dict[str, list[str]] = {}
        self.figures: dict[str, int] = {}
        self.pictures: dict[str, str] = {}
        self.ids: list[str] = []
        self.open: list[str] = []
        self._figure = ""
        self._rows: list[list[str]] = []
        self._caption = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.references += [given[name] for name in REFERENCES if name in given]
        if "id" in given:
            self.ids.append(given["id"])
        self.text.setdefault(tag, []).append("")
        self.open.append(tag)
        if tag == "figure":
            self._figure = given["id"]
            self.figures[self._figure] = 0
        if tag in ("path", "use", "image") and self._figure:
            self.figures[self._figure] += 1
        if tag == "img" and self._figure:
            self.pictures[self._figure] = given["src"]
        if tag == "table":
            self._rows = []
        if tag == "tr":
            self._rows.append([])
        if tag in ("td", "th"):
            self._rows[-1].append("")

    def handle_endtag(self, tag: str) -> None:
        while self.open and self.open.pop() != tag:
            pass
        if tag == "figure":
            self._figure = ""
        if tag == "table":
            self.tables[self._caption] = self._rows
            self._caption = ""

    def handle_data(self, data: str) -> None:
        for tag in set(self.open):
            self.text[tag][-1] += data
        if "caption" in self.open:
            self._caption += data
        elif self.open and self.open[-1] in ("td", "th"):
            self._rows[-1][-1] += data

    def table(self, words: str) -> list[list[str]]:
        """Rows of the one table whose caption holds `words`, the head first."""
        found = [rows for caption, rows in self.tables.items() if words in caption]
        assert len(found) == 1, f"{len(found)} tables with {words}"
        return found[0]
