"""Questions, and their answers in a TOML file: each is checked, and kept as soon as it is given."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w

from birdstrike.data.errors import UserError
from birdstrike.data.nearest import did_you_mean
from birdstrike.data.storage.files import write_atomically

Key = tuple[str, ...]
DECIDES = ("kind", "shape")
"""Ends of the keys whose answers decide what else is asked in their table."""


@dataclass(frozen=True)
class Question:
    """key: path of the answer in the file; text: what is asked; default: None where the answer must be given.

    check: the answer as it is kept; raises UserError, without the key, for one that cannot be. allowed: in words.
    stand_in: with what to go on where there is neither an answer nor a default, so that all errors are found at once.
    """

    key: Key
    text: str
    default: Any
    check: Callable[[Any], Any]
    allowed: str = ""
    stand_in: Any = None

    @property
    def name(self) -> str:
        """The dotted key."""
        return dotted(self.key)


def dotted(key: Key) -> str:
    """A key as TOML writes it: ("columns", "Disp Z (mm)") is columns."Disp Z (mm)"."""
    return ".".join(part if re.fullmatch(r"[A-Za-z0-9_-]+", part) else f'"{part}"' for part in key)


@dataclass
class Answers:
    """given: answers at hand, nested as in the file; prompt: asks the user, None where nobody is there to answer.

    prompt(question, error) returns what was typed; error: why the last answer was refused, "" at first. path: where
    every accepted answer is kept at once; accepted: those of this interview, with their questions; refused: key -> why
    its answer cannot be, where nobody can correct it: the interview goes on with the default, and then raises them.
    """

    given: Mapping[str, Any] = field(default_factory=dict)
    prompt: Callable[[Question, str], str] | None = None
    path: Path | None = None
    accepted: dict[Key, tuple[Any, str]] = field(default_factory=dict)
    refused: dict[Key, list[str]] = field(default_factory=dict)

    def ask(self, question: Question) -> Any:
        """The answer, checked; one that nobody can correct is refused with its key."""
        value, error = self._given(question.key), ""
        if value is not None or self.prompt is None:
            try:
                return self._keep(question, self._unasked(question, value))
            except UserError as refused:
                if self.prompt is None:
                    return self._refuse(question, value, refused)
                error = _named(question, value, "; ".join(refused.errors))
        assert self.prompt is not None
        while True:
            typed = self.prompt(question, error)  # which itself may raise: the input has ended
            try:
                return self._keep(question, question.check(typed))
            except UserError as refused:
                error = "; ".join(refused.errors)
                error += f" (allowed: {question.allowed})" if question.allowed and question.allowed not in error else ""

    def settle(self, question: Question) -> Any:
        """The default, which alone can be: nobody is asked. Another answer is refused."""
        value = self._given(question.key)
        try:
            return self._keep(question, self._unasked(question, value))
        except UserError as refused:
            return self._refuse(question, value, refused)

    def _refuse(self, question: Question, value: Any, why: UserError) -> Any:
        """What to go on with in the place of an answer that cannot be; raises UserError where there is nothing."""
        self.refused[question.key] = [_named(question, value, line) for line in why.errors]
        if question.default is None and question.stand_in is None:
            raise UserError([]) from why
        return self._keep(question, question.check(question.stand_in if question.default is None else question.default))

    def refuse(self, last: UserError | None = None) -> None:
        """Raise UserError with all that was refused, and the error that ended the interview; else do nothing."""
        if not self.refused:
            if last is not None:
                raise last
            return
        lines = [line for lines in self.refused.values() for line in lines]
        lines += self._beside_the_refused() if last is None else last.errors
        raise UserError(dict.fromkeys(lines)) from last

    def _beside_the_refused(self) -> list[str]:
        """Lines for answers that belong to no question, but where a refused one decides what is asked."""
        unsure = [key[:-1] for key in self.refused if key[-1] in DECIDES]
        unsure += [("columns",) for key in self.refused if key[0] == "record"]
        return self.never_asked(lambda key: any(key[: len(table)] == table for table in unsure))

    def rename(self, table: str, names: Mapping[str, str]) -> None:
        """Take what stands in a table under other names of the same things."""
        held = self.given.get(table)
        if isinstance(held, Mapping):
            self.given = {**self.given, table: {names.get(name, name): value for name, value in held.items()}}

    def forget(self, *keys: Key) -> None:
        """Answers that turned out not to go together are asked again; the others, typed ones too, are at hand."""
        held = dict(_leaves(self.given)) | {key: value for key, (value, _) in self.accepted.items()}
        table: dict[str, Any] = {}
        for key, value in held.items():
            if key not in keys:
                _put(table, key, value)
        self.given, self.accepted = table, {}

    def never_asked(self, unsure: Callable[[Key], bool] = lambda _: False) -> list[str]:
        """A line for each answer that belongs to no question of this interview; unsure: keys that are passed over."""
        asked = {dotted(key) for key in self.accepted}
        lines = []
        for key in (dotted(key) for key, _ in _leaves(self.given) if not unsure(key)):
            if key not in asked:
                hint = did_you_mean(key, sorted(asked))
                lines.append(f"{key} is no question about this record" + (f"; {hint}" if hint else ""))
        return lines

    def text(self) -> str:
        """The accepted answers as TOML, each below its question."""
        lines = [
            "# Answers for: birdstrike start --answers THIS_FILE. Change one and start again; what stands is used."
        ]
        table: Key = ()
        for key in sorted(self.accepted, key=lambda one: (self._place(one[:-1]), list(self.accepted).index(one))):
            value, text = self.accepted[key]
            if key[:-1] != table:
                table = key[:-1]
                lines += ["", f"[{dotted(table)}]"]
            lines += [f"# {text}", f"{dotted(key[-1:])} = {literal(value)}"]
        return "\n".join(lines) + "\n"

    def _place(self, table: Key) -> int:
        """Where a table was first asked about: a file holds each once."""
        return next(i for i, key in enumerate(self.accepted) if key[:-1] == table)

    def _keep(self, question: Question, value: Any) -> Any:
        self.accepted[question.key] = value, question.text
        if self.path is not None and self.prompt is not None:
            self.save()
        return value

    def save(self) -> None:
        """Write the accepted answers, and those at hand that have not been asked for yet."""
        assert self.path is not None
        kept = dict(self.accepted)
        for key, value in _leaves(self.given):
            if key not in self.accepted:
                self.accepted[key] = value, "given before"
        write_atomically(self.path, self.text())
        self.accepted = kept

    def _given(self, key: Key) -> Any:
        value: Any = self.given
        for part in key:
            value = value.get(part) if isinstance(value, Mapping) else None
        return value

    def _unasked(self, question: Question, value: Any) -> Any:
        """The value at hand, or the default."""
        if value is not None:
            return question.check(value)
        if question.default is None:
            raise UserError(f"is missing: {question.text}")
        return question.check(question.default)


def read_answers(path: Path) -> dict[str, Any]:
    """Content of a file of answers; raises UserError."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise UserError(f"--answers {path}: there is no such file") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise UserError(f"{path} is no TOML: {error}") from error


def about(given: Mapping[str, Any], record: Path | None) -> Mapping[str, Any]:
    """Answers about another measured file than they name, where one is given."""
    held = given.get("record", {})
    if record is None or not isinstance(held, Mapping):
        return given
    return {**given, "record": {**held, "file": str(record)}}


def literal(value: Any) -> str:
    """A value as TOML has it, on one line."""
    if isinstance(value, list | tuple):
        return f"[{', '.join(literal(one) for one in value)}]"
    return tomli_w.dumps({"x": value}).removeprefix("x = ").strip()


def _named(question: Question, value: Any, line: str) -> str:
    """An error with its key, its value and what is allowed."""
    shown = question.name if value is None else f"{question.name} = {literal(value)}"
    allowed = f" (allowed: {question.allowed})" if question.allowed and question.allowed not in line else ""
    return f"{shown} {line}{allowed}"


def _leaves(table: Mapping[str, Any], place: Key = ()) -> Iterator[tuple[Key, Any]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _leaves(value, (*place, name))
        else:
            yield (*place, name), value


def _put(table: dict[str, Any], key: Key, value: Any) -> None:
    for part in key[:-1]:
        table = table.setdefault(part, {})
    table[key[-1]] = value
