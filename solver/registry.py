"""Registries: the library's kinds of a thing, those of installed packages, and those that a script adds.

A kind is one file and one line in the library's table; an installed package brings its own by an entry point.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cached_property
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Generic, TypeVar, cast, get_args

from pydantic import GetCoreSchemaHandler, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError, core_schema

from birdstrike.data.errors import UserError
from birdstrike.solver.fields import OneOf, Section, checked, complaint
from birdstrike.solver.sources import defining_module, digest_of_module, in_tree

T = TypeVar("T")
S = TypeVar("S", bound=Section)


class Registry(Mapping[str, T], Generic[T]):
    """Things by name: the library's in its order, then those of installed packages, then those added in this process.

    what: a thing in words ("sensor kind"); group: of the installed packages' entry points, loaded when first needed,
    None for a registry that they cannot add to; base: class of the things; name_of: a thing's name, from its entry
    point and itself; code_of: the class or function that computes what a thing does.
    """

    def __init__(
        self,
        what: str,
        group: str | None,
        library: Mapping[str, T],
        base: type[Any],
        name_of: Callable[[EntryPoint, T], str] = lambda entry, _: entry.name,
        code_of: Callable[[T], Any] = lambda thing: thing,
    ) -> None:
        self.what, self.group, self.base = what, group, base
        self.library, self.name_of, self.code_of = dict(library), name_of, code_of
        self.own: dict[str, tuple[T, str]] = {}
        """Things added in this process, each with the module that defines it."""

    def __getitem__(self, name: str) -> T:
        found = self.library.get(name)
        return self._outside[name][0] if found is None else found

    def __iter__(self) -> Iterator[str]:
        return iter((*self.library, *self._outside))

    def __len__(self) -> int:
        return len(self.library) + len(self._outside)

    def __hash__(self) -> int:
        return id(self)

    def __eq__(self, other: object) -> bool:
        return self is other

    @property
    def _outside(self) -> dict[str, tuple[T, str]]:
        """Things from outside the tree, each with the module that defines it."""
        return self._installed | self.own

    @cached_property
    def _installed(self) -> dict[str, tuple[T, str]]:
        found: dict[str, tuple[T, str]] = {}
        for entry in entry_points(group=self.group) if self.group else ():
            thing = self._loaded(entry)
            name = self.name_of(entry, thing)
            if name in self.library or name in found:
                raise UserError(
                    f'the {self.what} "{name}" of the installed package {_package(entry)} exists already; rename it '
                    "there or uninstall that package"
                )
            module = defining_module(self.code_of(thing))
            found[name] = (thing, entry.module if not module or in_tree(module) else module)
        return found

    def _loaded(self, entry: EntryPoint) -> T:
        try:
            thing = entry.load()
            reason = self.fault(entry.name, thing)
        except Exception as error:  # whatever a package from outside may raise
            thing, reason = None, f"{type(error).__name__}: {error}"
        if reason:
            raise UserError(
                f"the {self.what} {entry.value} of the installed package {_package(entry)} cannot be used: {reason}; "
                "correct or uninstall that package"
            )
        return cast(T, thing)

    def fault(self, _name: str, thing: Any, /) -> str:
        """Why a thing from outside cannot be registered under a name; empty where it can."""
        return "" if isinstance(thing, self.base) else f"it is no {self.base.__name__}"

    def sources(self, names: Iterable[str]) -> dict[str, str]:
        """Digest of the sources of each of these that comes from outside the tree: part of a run's key."""
        outside = {name: digest_of_module(self._outside[name][1]) for name in names if name not in self.library}
        return {f"{self.what} {name}": digest for name, digest in outside.items() if digest}


class Kinds(Registry[type[S]]):
    """Registry of the tables that a place of a case may hold: a discriminated union, whose `key` names the kind.

    Used as an annotation, `Annotated[Law, LAWS]`. The errors are those of the chosen table alone; kinds that are
    registered after the case's schema was built are known too.
    """

    def __init__(self, what: str, key: str, group: str | None, library: Mapping[str, type[S]], base: type[S]) -> None:
        super().__init__(what, group, library, base)
        self.key = key

    def fault(self, name: str, thing: Any, /) -> str:
        """It must be a table's class that declares all that its base leaves open, and the name under its key."""
        if not (isinstance(thing, type) and issubclass(thing, self.base)):
            return f"it is no {self.base.__name__}"
        missing = sorted(name for name in self.base.__class_vars__ if not hasattr(thing, name))
        if missing:
            return f"its class declares no {', '.join(missing)}"
        if get_args(thing.model_fields[self.key].annotation) != (name,):
            return f'its class does not declare {self.key}: Literal["{name}"], the name of its entry point'
        return ""

    def chosen(self, content: Any) -> type[S] | None:
        """The kind that a table as read has chosen; None where it has chosen none that is known."""
        name = content.get(self.key) if isinstance(content, Mapping) else None
        return self.get(name) if isinstance(name, str) else None

    def validate(self, value: Any) -> S:
        """The table, of the kind that it names; raises PydanticCustomError or ValidationError."""
        if isinstance(value, self.base):
            return value
        if not isinstance(value, Mapping):
            raise complaint("must be a table of keys")
        found = self.chosen(value)
        return self.refuse(value) if found is None else found.model_validate(value)

    def foreign(self, _key: str, /) -> str:
        """Why the chosen kind has no such key, where others have it; empty if nothing is to be said of that."""
        return ""

    def refuse(self, value: Mapping[str, Any]) -> Any:
        """Raise ValidationError for a table that names no known kind."""
        raise errors_of([self.unknown(value)])

    def unknown(self, value: Mapping[str, Any]) -> InitErrorDetails:
        """What is wrong with the kind that a table names, or does not name."""
        choices = OneOf(tuple(self), more=self._where_own_kinds_go)
        if self.key not in value:
            return InitErrorDetails(type=complaint(f"is missing; {choices.here}"), loc=(self.key,), input=dict(value))
        given = value[self.key]
        try:
            choices.validate(given)
        except PydanticCustomError as error:
            return InitErrorDetails(type=error, loc=(self.key,), input=given)
        raise AssertionError(f"{given} is a known {self.what}")

    @property
    def _where_own_kinds_go(self) -> str:
        """How a kind that the library has not is added; empty where none can be."""
        return f"; one of your own: an installed package's entry point of the group {self.group}" if self.group else ""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return checked(self.validate)


def errors_of(details: list[InitErrorDetails]) -> ValidationError:
    """Errors about keys of one table."""
    return ValidationError.from_exception_data("case", details)


def _package(entry: EntryPoint) -> str:
    return entry.dist.name if entry.dist is not None else entry.module
