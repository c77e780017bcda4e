"""Errors cross process borders whole, whichever way exceptions are reduced there."""

from __future__ import annotations

import copyreg
import inspect
import pickle
from types import TracebackType

import pytest

from birdstrike.data import errors
from birdstrike.data.errors import CaseError, MachineFailure, RunFailed, UserError

Known = UserError | RunFailed | MachineFailure
CLASSES: list[type[Known]] = [
    kind
    for _, kind in inspect.getmembers(errors, inspect.isclass)
    if issubclass(kind, (UserError, RunFailed, MachineFailure)) and kind.__module__ == errors.__name__
]


@pytest.fixture(params=[False, True])
def with_causes(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> bool:
    """Whether causes and contexts are reduced too, as everywhere once dask has been imported (pint does, if it can)."""
    table, kinds = copyreg.dispatch_table, (*CLASSES, ValueError, KeyError)
    for kind in kinds:
        monkeypatch.delitem(table, kind, raising=False)
    if request.param:
        reducers = pytest.importorskip("tblib.pickling_support")
        monkeypatch.setitem(table, TracebackType, reducers.pickle_traceback)
        for kind in kinds:
            monkeypatch.setitem(table, kind, reducers.pickle_exception)
    return request.param


def raised(kind: type[Known]) -> Known:
    """One with a cause, whose own context is another error."""
    try:
        try:
            try:
                raise KeyError("missing")
            except KeyError:
                raise ValueError("the cause")  # noqa: B904
        except ValueError as cause:
            raise kind("what was wrong", "more about it") from cause
    except kind as error:
        found = error
    return found


def test_what_was_wrong_and_its_remedy_are_still_there() -> None:
    error = pickle.loads(pickle.dumps(CaseError(["one", "two"], "case x: 2 errors")))
    assert (error.errors, error.heading, error.exit_code) == (["one", "two"], "case x: 2 errors", 1)
    assert isinstance(error, UserError)
    failed = pickle.loads(pickle.dumps(RunFailed("unstable", "lower solver.courant")))
    assert (failed.reason, failed.remedy, failed.exit_code) == ("unstable", "lower solver.courant", 2)


@pytest.mark.parametrize("kind", CLASSES)
def test_errors_cross_a_process_border_whole(kind: type[Known], with_causes: bool) -> None:
    error = raised(kind)
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is kind
    assert str(again) == str(error)
    assert vars(again) == vars(error)
    assert again.exit_code == kind.exit_code
    if with_causes:
        assert isinstance(again.__cause__, ValueError)
        assert isinstance(again.__cause__.__context__, KeyError)
