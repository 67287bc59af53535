"""Files that a command's parameters name: what is read, what is written, and when it may be.

Every parameter that names a file says so in its annotation, beside its option. What is written is
looked at before the command runs: a command need not, and cannot forget it.
"""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args, get_type_hints

import typer
from typer.models import OptionInfo

from tomoskin.core import registered

if TYPE_CHECKING:
    from tomoskin.core import Output

Given = Mapping[str, Any]
"""Arguments of a command by the names of its parameters."""

ForceFlag = Annotated[
    bool,
    typer.Option(
        "--force", help="Overwrite files that exist. Inputs and recordings are never overwritten."
    ),
]
"""The --force option of every command that writes anything but recordings."""

RECORDING = {".mcap": "a recording"}
TABLE = {".csv": "a table"}
CALIBRATION = {".npz": "a calibration"}
SKIN = {".toml": "a skin file"}
FIGURE = {".png": "a picture", ".pdf": "a figure", ".svg": "a drawing"}


_PACKAGES = {
    **dict.fromkeys((".png", ".pdf", ".svg", ".gif", ".mp4"), ("matplotlib", "plot")),
    ".parquet": ("pyarrow", "parquet"),
    ".h5": ("h5py", "hdf5"),
}
"""What an output of that ending is made by: the package, and the extra that brings it."""


def package_of(ending: str) -> tuple[str, str]:
    """The package that makes an output of that ``ending``, and the extra that brings it."""
    return _PACKAGES.get(ending, ("", ""))


@dataclass(frozen=True)
class Reads:
    """The file, or the files of the folder, that the parameter names are only read."""


@dataclass(frozen=True)
class Otherwise:
    """The file that the parameter names is treated in a way of its own: it says which."""

    why: str


@dataclass(frozen=True)
class Writes:
    """The file that the parameter names is written.

    Attributes
    ----------
    endings
        What its name may end in, and what each gives.
    files
        The files that are written, where it is not just the one: of the value, all arguments,
        and what a person calls the parameter.
    package
        Which package makes a file of an ending, and the extra that brings it.
    """

    endings: Mapping[str, str]
    files: Callable[[Path | None, Given, str], Iterable[Output]] | None = None
    package: Callable[[str], tuple[str, str]] = package_of

    def outputs(self, value: Path | None, given: Given, called: str) -> Iterable[Output]:
        """The files that are to be checked."""
        from tomoskin.core import Output

        if self.files is not None:
            return self.files(value, given, called)
        return () if value is None else (Output(value, self.endings, called),)


class Added(tuple[Any, ...]):
    """Options that extras add to a command: a parameter with this annotation takes their records.

    A record is registered at the seam "options" as ``"COMMAND NAME"``, or ``"GROUP COMMAND NAME"``.
    What it may do is for the command to say.
    """


def spread(command: Callable[..., None], name: str = "") -> Callable[..., None]:
    """The command with the options of its groups, which are records, as parameters of its own.

    ``name`` is that of the command, with its group's, for options that are :class:`Added` to it.
    """
    hints = get_type_hints(command, include_extras=True)
    groups: dict[str, tuple[Any, ...]] = {
        key: added_to(name) if hint is Added else (hint,)
        for key, hint in hints.items()
        if hint is Added or is_dataclass(hint)
    }
    if not groups:
        return command

    def run(**given: Any) -> None:
        for key, records in groups.items():
            made = Added(
                record(**{one.name: given.pop(one.name) for one in fields(record)})
                for record in records
            )
            given[key] = made if hints[key] is Added else made[0]
        command(**given)

    options: dict[str, tuple[Any, Any]] = {}
    for key, parameter in inspect.signature(command).parameters.items():
        for record in groups.get(key, ()):
            own = get_type_hints(record, include_extras=True)
            options |= {one.name: (own[one.name], one.default) for one in fields(record)}
        if key not in groups:
            options[key] = hints[key], parameter.default
    return with_options(run, command, options)


def added_to(name: str) -> tuple[Any, ...]:
    """The records of options that are registered for the command of that ``name``."""
    entries = registered("options").values()
    return tuple(entry.load() for entry in entries if entry.name.rpartition(" ")[0] == name)


def with_options(
    run: Callable[..., None], command: Callable[..., Any], options: Mapping[str, tuple[Any, Any]]
) -> Callable[..., None]:
    """``run``, which takes ``options``, annotation and default, described as the ``command`` is."""
    run.__name__, run.__doc__ = command.__name__, command.__doc__
    run.__annotations__ = {name: annotation for name, (annotation, _) in options.items()}
    parameters = [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation
        )
        for name, (annotation, default) in options.items()
    ]
    run.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    return run


def guarded(command: Callable[..., None]) -> Callable[..., None]:
    """The command; what it writes is looked at before it runs, against all that it is given.

    Raises OutputError as :func:`tomoskin.core.check_outputs` does, and DataError where the package
    that would write is not installed.
    """
    written = dict(_written(command))
    if not written:
        return command

    @functools.wraps(command)
    def run(**given: Any) -> None:
        from tomoskin.core import check_outputs

        outputs = [
            (output, writes.package)
            for name, (called, writes) in written.items()
            for output in writes.outputs(given[name], given, called)
        ]
        inputs = [
            path for name, value in given.items() if name not in written for path in _files(value)
        ]
        overwrite = given.get("force", False)
        consent = "--force" if "force" in given else ""
        named = [output for output, _ in outputs]
        check_outputs(named, inputs, overwrite=overwrite, consent=consent)
        for output, package in outputs:
            _check_package(output, *package(output.path.suffix.lower()))
        command(**given)

    return run


def _check_package(output: Output, package: str, extra: str) -> None:
    from tomoskin.core import DataError, install_hint

    if package and find_spec(package) is None:
        raise DataError(
            f"needs {package} to write it, which is not installed",
            where=f"{output.name} {output.path}".strip(),
            hint=install_hint(extra),
        )


def _written(command: Callable[..., None]) -> Iterator[tuple[str, tuple[str, Writes]]]:
    """Each parameter that names what is written: what a person calls it, and its mark."""
    hints = get_type_hints(command, include_extras=True)
    for name in inspect.signature(command).parameters:
        marks = get_args(hints.get(name))
        for writes in (mark for mark in marks if isinstance(mark, Writes)):
            called = next(_called(name, info) for info in marks if hasattr(info, "metavar"))
            yield name, (called, writes)


def _called(name: str, info: Any) -> str:
    return f"--{name.replace('_', '-')}" if isinstance(info, OptionInfo) else info.metavar or name


def _files(value: Any) -> Iterator[Path]:
    """What an argument may name: a path, or the text of an option that also takes other things,
    as NAME=FILE does; of a list, what each names."""
    if isinstance(value, Path):
        yield value
    elif isinstance(value, str) and value:
        yield from map(Path, {value, value.partition("=")[2]} - {""})
    elif isinstance(value, list):
        for one in value:
            yield from _files(one)
