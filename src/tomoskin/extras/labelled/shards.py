"""Labelled frames by the thousand: shards made by many processes or machines, each there
whole or not at all, then one file."""

from __future__ import annotations

import contextlib
import os
import signal
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tomoskin.core import (
    Arrays,
    DataError,
    Output,
    OutputError,
    SourceError,
    StrPath,
    check_outputs,
    install_hint,
    load_arrays,
    save_arrays,
)
from tomoskin.extras.labelled import fingerprint
from tomoskin.extras.labelled.population import SetPlan, make_shard

_PATIENCE = 10.0
"""Seconds for a scheduler to answer."""

_LISTED = 3

Made = Iterator[tuple[int, dict[str, Any]]]
"""Shards with their numbers, in whatever order they are finished."""

Workers = Callable[[SetPlan, Sequence[int]], Made]
"""What makes shards of a plan."""


@dataclass(frozen=True)
class SetMade:
    """What became of a set: shards that were there already, and made now; the files."""

    kept: int
    made: int
    files: tuple[Path, ...]


def make_set(
    plan: SetPlan,
    out: StrPath,
    workers: Workers,
    advance: Callable[[int, int], None],
    *,
    overwrite: bool = False,
) -> SetMade:
    """Make the shards of ``plan`` that are missing, and write them.

    Parameters
    ----------
    out
        A folder of shards; or a name that ends in .npz for one file: its shards then stand in a
        folder beside it until all are there.
    advance
        Called with the frames that are done and all of them.
    overwrite
        The file, or files of other sets in the folder, may be written over.

    Raises
    ------
    OutputError
        Before anything is made: when the file is there, or the folder holds another set.
    DataError
        When a file cannot be written.
    ScriptError
        When there is no room on the skin for what is to be drawn.
    """
    out = Path(out)
    single = out.suffix.lower() == ".npz"
    if single:
        check_outputs([Output(out, makes_folders=True)], overwrite=overwrite)
    folder = out.with_name(f"{out.name}.parts") if single else out
    paths = [shard_path(folder, shard) for shard in range(plan.n_shards)]
    missing = [
        shard
        for shard, path in enumerate(paths)
        if not is_done(path, shard_identity(plan, shard), overwrite=overwrite)
    ]
    done = plan.n_frames - sum(map(plan.size, missing))
    advance(done, plan.n_frames)
    for shard, arrays in workers(plan, missing):
        write_whole(paths[shard], arrays, overwrite=True)  # one with fewer frames, if any
        done += plan.size(shard)
        advance(done, plan.n_frames)
    if single:
        join_shards(paths, out, overwrite=overwrite)
        for path in paths:
            path.unlink()
        folder.rmdir()
    files = (out,) if single else tuple(paths)
    return SetMade(plan.n_shards - len(missing), len(missing), files)


def shard_identity(plan: SetPlan, shard: int) -> str:
    """What a shard's file says of itself."""
    return f"{plan.identity} {shard} {plan.size(shard)}"


def in_this_process(plan: SetPlan, shards: Sequence[int]) -> Made:
    """Make the shards here, one after the other."""
    for shard in shards:
        yield shard, make_shard(plan, shard)


def in_processes(n: int) -> Workers:
    """Workers that are ``n`` processes of this machine.

    They import the twin alone. Ctrl-C reaches every process of a terminal: they leave it to this
    one, which ends them.
    """
    calm = (signal.SIGINT, signal.SIG_IGN)

    def run(plan: SetPlan, shards: Sequence[int]) -> Made:
        count = min(n, len(shards) or 1)
        with ProcessPoolExecutor(count, get_context("spawn"), signal.signal, calm) as pool:
            futures = {pool.submit(make_shard, plan, shard): shard for shard in shards}
            with _cancelled(list(futures)):
                for future in as_completed(futures):
                    yield futures[future], future.result()

    return run


def on_cluster(address: str) -> Workers:
    """Workers of a Dask cluster whose scheduler is at ``address``; they need this tomoskin too.

    Versions, and a hash of what computes, are compared before any frame is made. Raises
    SourceError, which names each worker that differs.
    """

    def run(plan: SetPlan, shards: Sequence[int]) -> Made:
        try:
            import cloudpickle
            from dask import distributed
        except ImportError as error:
            raise SourceError(
                "needs Dask's distributed", where=address, hint=install_hint("cluster")
            ) from error
        try:
            client = distributed.Client(address, timeout=_PATIENCE)
        except (OSError, TimeoutError, ValueError) as error:
            raise SourceError(f"no scheduler answers: {error}", where=address) from error
        cloudpickle.register_pickle_by_value(fingerprint)
        with client:
            ours = fingerprint.fingerprint()
            _check_workers(client.run(fingerprint.fingerprint), ours, address)
            futures = client.map(
                partial(fingerprint.made_alike, ours),
                [plan] * len(shards),
                list(shards),
                pure=False,
            )
            number = dict(zip((future.key for future in futures), shards, strict=True))
            for future, arrays in distributed.as_completed(futures, with_results=True):
                yield number[future.key], arrays

    return run


def _check_workers(
    fingerprints: Mapping[str, dict[str, str]], ours: dict[str, str], address: str
) -> None:
    """Raise SourceError that names the workers on which others would compute."""
    unlike = {
        worker: fingerprint.differences(ours, theirs) for worker, theirs in fingerprints.items()
    }
    others = [f"{worker} has {said}" for worker, said in unlike.items() if said]
    if others:
        raise SourceError(
            f"expected workers with the tomoskin of this computer, got {len(others)} others: "
            f"{'; '.join(others[:_LISTED])}{'; …' if len(others) > _LISTED else ''}",
            where=address,
            hint="install the same versions there, and start the workers again",
        )


def processors() -> int:
    """Processors that this process may use."""
    with contextlib.suppress(AttributeError):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextlib.contextmanager
def _cancelled(futures: list[Future[dict[str, Any]]]) -> Iterator[None]:
    """Shards that nobody waits for any more are not begun."""
    try:
        yield
    finally:
        for future in futures:
            future.cancel()


IDENTITY = "identity"
"""Array that says of which set and shard a file is."""

_DAMAGED = "damaged"
"""What a shard says of itself that cannot be read to its end."""

_FIXED = ("drive", "measure", "reference")
"""Arrays that are the same in every shard."""


def shard_path(folder: StrPath, shard: int) -> Path:
    """The file of one shard in the folder of a set."""
    return Path(folder) / f"part-{shard:05d}.npz"


def write_whole(
    path: StrPath, arrays: Mapping[str, NDArray[Any]], *, overwrite: bool = False
) -> None:
    """:func:`save_arrays` into a folder that is made where it is not there."""
    try:
        Path(path).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise DataError(f"cannot be written: {error.strerror}", where=str(path)) from error
    save_arrays(path, arrays, overwrite=overwrite)


def is_done(path: StrPath, identity: str, *, overwrite: bool = False) -> bool:
    """Whether the shard is there, whole, and the one of this ``identity``.

    A damaged shard, or one of the set with fewer frames, is to be made again. Raises OutputError
    for any other file, unless ``overwrite``.
    """
    if not Path(path).exists():
        return False
    present = _identity_in(Path(path))
    if present.split()[:1] == identity.split()[:1]:
        return present == identity
    if present != _DAMAGED and not overwrite:
        raise OutputError(
            f"belongs to another set: expected {identity}, got {present or 'no part of a set'}",
            where=str(path),
            hint="choose another folder, or remove the files in it",
        )
    return False


def _identity_in(path: Path) -> str:
    """What a file says of itself; "" where it says nothing."""
    try:
        with zipfile.ZipFile(path) as archive:
            if archive.testzip() is not None:
                return _DAMAGED
        return str(load_arrays(path)[IDENTITY])
    except KeyError:
        return ""
    except (DataError, OSError, zipfile.BadZipFile):
        return _DAMAGED if f"{IDENTITY}.npy".encode() in path.read_bytes() else ""


def join_shards(paths: Iterable[StrPath], path: StrPath, *, overwrite: bool = False) -> None:
    """One file of all shards, in their order.

    Raises
    ------
    DataError
        When a shard cannot be read or the file cannot be written.
    """
    shards = [load_arrays(part) for part in paths]
    joined: Arrays = {
        key: shards[0][key] if key in _FIXED else np.concatenate([shard[key] for shard in shards])
        for key in shards[0]
        if key != IDENTITY
    }
    write_whole(path, joined, overwrite=overwrite)
