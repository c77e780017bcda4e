"""Lines of a text file in UTF-8, UTF-16 or an older encoding, which is said, for it can only be guessed."""

from __future__ import annotations

import re
from pathlib import Path

from birdstrike.data.errors import MeasuredError

_MINUS = re.compile(r"[\u2212\u2012\u2013](?=[\d.])")
"""A minus sign as typesetting programs write it."""

GUESSES = {
    "gb2312": "GBK (Chinese)",
    "cp932": "Shift-JIS (Japanese)",
    "cp1253": "Windows-1253 (Greek)",
    "cp1251": "Windows-1251 (Cyrillic)",
    "gb18030": "GB18030 (Chinese)",
    "cp1252": "Windows-1252 (Western European)",
    "latin-1": "Latin-1 (Western European)",
}
"""Encodings that are recognised, in the order in which they are tried: each takes hardly a text of those behind it for
one of its own, and the last any."""
EXAMPLES = "utf-8, cp1252, gb18030, big5, shift_jis, euc_jp or euc_kr"
_IDEOGRAPHS = re.compile("[\u3040-\u30ff\u3400-\u9fff]+")
_BEYOND_ASCII = re.compile("[^\0-\x7f]")
_WORDS = re.compile(r"[^\W\d_]+")
_GREEK = re.compile("[\u0386-\u038f\u0391-\u03ab]?[\u0390\u03ac-\u03ce]+|[\u0386-\u038f\u0391-\u03ab]+")
"""A word of Greek letters, small ones but for the first, or all large; of Cyrillic bytes others begin large."""
_ACCENTS = re.compile("[\u0386\u0388-\u038f\u0390\u03ac-\u03b0\u03cc-\u03ce]")
_CYRILLIC = re.compile("[\u0410-\u044f\u0401\u0451]?[\u0430-\u044f\u0451]+|[\u0410-\u042f\u0401]+")
"""A word of Cyrillic letters, small ones but for the first, or all large."""
SHORT = 3
"""Letters of the longest Greek words that may have no accent."""
SECOND_LEVEL = 0xD8
"""First byte of the rare signs of GB 2312."""
_BEYOND = re.compile("[^\0-\u04ff\u2000-\u22ff\u3000-\u303f\uff00-\uff60\uffe0-\uffef]")
"""Signs that are neither Latin, Greek or Cyrillic, nor punctuation of any width."""


def text_lines(path: Path) -> list[str]:
    """Lines of a text file; raises MeasuredError where it is none."""
    return decoded_lines(path, "")[0]


def decoded_lines(path: Path, encoding: str) -> tuple[list[str], str]:
    """Lines of a text file, and in words the encoding that was guessed, "" where it is sure or `encoding` states it.

    Raises MeasuredError.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise MeasuredError(f"{path} cannot be read: {error.strerror}") from error
    text, guessed = (_stated(path, content, encoding), "") if encoding else _decoded(content)
    if "\0" in text:
        raise MeasuredError(f"{path} is no text file; export the curve as text first")
    return _MINUS.sub("-", text).splitlines(), guessed


def _stated(path: Path, content: bytes, encoding: str) -> str:
    """Text in the encoding that the user states."""
    try:
        return content.decode(encoding).removeprefix("\ufeff")
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        raise MeasuredError(
            f"{path}, line {line}: its bytes are no text in --encoding {encoding}; leave the option out, or state "
            f"another, such as {EXAMPLES}"
        ) from error
    except (LookupError, ValueError, AttributeError) as error:
        raise MeasuredError(
            f"--encoding {encoding} is no encoding that is known; write one such as {EXAMPLES}"
        ) from error


def _decoded(content: bytes) -> tuple[str, str]:
    """Text, and in words the encoding that was guessed."""
    for sure in (_utf_16(content), "utf-8-sig"):
        text = _in(sure, content) if sure else None
        if text is not None and "\0" not in text:
            return text, ""
    return next(
        (text, words)
        for name, words in GUESSES.items()
        if (text := _in(name, content)) is not None and _READS.get(name, _reads)(text)
    )


def _in(encoding: str, content: bytes) -> str | None:
    """Text in an encoding, None where the bytes are none."""
    try:
        return content.decode(encoding)
    except UnicodeDecodeError:
        return None


def _reads(_text: str) -> bool:
    """Of an encoding that is tried where no other is left."""
    return True


def _reads_as_chinese(text: str) -> bool:
    """Whether a text reads as words, and half of its ideographs are of the usual ones, the first level of GB 2312.

    Small Greek and Cyrillic letters, two by two, are of the second level, of rare signs.
    """
    signs = "".join(_IDEOGRAPHS.findall(text))
    level = sum(sign.encode("gb2312")[0] < SECOND_LEVEL for sign in signs)
    return _reads_as_words(text) and 2 * level >= len(signs)


def _reads_as_greek(text: str) -> bool:
    """Whether the long words of a text's Greek letters have one accent each, as Greek spelling wants it."""
    words = [word for word in _WORDS.findall(text) if _GREEK.fullmatch(word)]
    accented = [len(_ACCENTS.findall(word)) == 1 for word in words if len(word) > SHORT]
    return len(accented) > 0 and 4 * sum(accented) >= 3 * len(accented) and _is_most_of(words, text)


def _reads_as_cyrillic(text: str) -> bool:
    """Whether the letters beyond ASCII stand in words of Cyrillic letters alone, as accented ones do not."""
    return _is_most_of([word for word in _WORDS.findall(text) if _CYRILLIC.fullmatch(word)], text)


def _is_most_of(words: list[str], text: str) -> bool:
    """Whether words of two letters and more are all but a tenth of a text's letters beyond ASCII."""
    found = sum(len(word) for word in words if len(word) > 1)
    return 0 < 9 * sum(letter.isalpha() for letter in _BEYOND_ASCII.findall(text)) <= 10 * found


def _reads_as_words(text: str) -> bool:
    """Whether the East Asian signs of a text stand in words of several.

    Western text read so gives them one by one: the second byte of each is that of the letter behind an accented one.
    """
    words = [len(word) for word in _IDEOGRAPHS.findall(text)]
    return 2 * sum(n for n in words if n > 1) > len(_BEYOND.findall(text))


def _utf_16(content: bytes) -> str:
    """The kind of UTF-16 by its mark, or by every second byte of the beginning being 0; empty for another encoding."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    start = content[:200]
    if len(start) < 4 or len(start) % 2:
        return ""
    return {(True, False): "utf-16-be", (False, True): "utf-16-le"}.get((not any(start[::2]), not any(start[1::2])), "")


_READS = {
    "gb2312": _reads_as_chinese,
    "cp932": _reads_as_words,
    "cp1253": _reads_as_greek,
    "cp1251": _reads_as_cyrillic,
    "gb18030": _reads_as_words,
}
"""How a text looks that is in an encoding which others' texts are bytes of, too."""
