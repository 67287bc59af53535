"""``tomoskin simulate --presses``: labelled frames instead of a script's timeline."""

from __future__ import annotations

import time
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer

from tomoskin.cli import Bar, ForceFlag, Given, SimulateOptions, remark, tell
from tomoskin.core import Output, ScriptError

if TYPE_CHECKING:
    from tomoskin.extras.labelled.population import SetPlan
    from tomoskin.extras.labelled.shards import Workers
    from tomoskin.model.skin import Skin


@dataclass(frozen=True)
class Labelled(SimulateOptions):
    """Labelled frames, and the processes or machines that make them."""

    ENDINGS: ClassVar[Mapping[str, str]] = {".npz": "labelled frames in one file"}

    presses: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Simulate N labelled frames of random presses instead of a recording; --out is "
            "then a folder or FILE.npz.",
        ),
    ] = None
    processes: Annotated[
        int | None,
        typer.Option(
            min=1, help="With --presses: number of processes. Default: one for each processor."
        ),
    ] = None
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="With --presses: address of a Dask scheduler, tcp://HOST:8786."
        ),
    ] = None

    force: ForceFlag = False

    @classmethod
    def outputs(cls, out: Path, given: Given, called: str) -> list[Output] | None:
        """Labelled frames, of which a folder that is there is looked into later."""
        if given["presses"] is None:
            return None
        if out.is_dir() and out.suffix.lower() != ".npz":
            return []
        endings = cls.ENDINGS if out.exists() else {**cls.ENDINGS, "": "a folder of them"}
        return [Output(out, endings, called, makes_folders=True)]

    def run(
        self, skin: Skin, script: Path | None, out: Path, seed: int | None, *, json: bool
    ) -> bool:
        """Make them where a number of frames is asked for; refuse what has no effect otherwise."""
        if self.presses is not None:
            plan = _plan(skin, script, seed or 0, self.presses)
            _labelled(plan, out, self.workers(), overwrite=self.force, json=json)
            return True
        if script is None:
            raise typer.BadParameter(
                "expected --script FILE or --presses N, got neither", param_hint="--script"
            )
        if self.processes is not None or self.cluster is not None:
            raise typer.BadParameter(
                "has an effect only with --presses", param_hint="--processes, --cluster"
            )
        _check_timeline(script)
        return False

    def workers(self) -> Workers:
        """Those processes or machines; one process for each processor where none are named."""
        from tomoskin.extras.labelled.shards import (
            in_processes,
            in_this_process,
            on_cluster,
            processors,
        )

        if self.cluster is not None:
            if self.processes is not None:
                raise typer.BadParameter(
                    "cannot be combined with --cluster", param_hint="--processes"
                )
            return on_cluster(self.cluster)
        n = self.processes or processors()
        return in_this_process if n == 1 else in_processes(n)


def _check_timeline(script: Path) -> None:
    """Refuse a script of labelled frames. What else is wrong with one is said where it is run."""
    from tomoskin.extras.labelled.population import Population
    from tomoskin.model.skin import read_text

    try:
        tables = tomllib.loads(read_text(script, "a script"))
    except ValueError:
        return
    if Population.section in tables:
        raise ScriptError(
            "describes labelled frames, not a timeline",
            where=f"{script}: {Population.heading}",
            hint="give the number of frames: --presses N",
        )


def _plan(skin: Skin, script: Path | None, seed: int, n: int) -> SetPlan:
    from tomoskin.extras.labelled.population import COMMON_PRESSES, Population, SetPlan
    from tomoskin.model.skin import read_text
    from tomoskin.twin import check_settling

    population = COMMON_PRESSES
    if script is not None:
        population = Population.from_toml(read_text(script, "a script"), source=str(script))
    preset = population.preset or skin.twin.preset
    check_settling(skin, preset)
    return SetPlan(skin.to_toml(), population, preset, seed, n)


def _labelled(plan: SetPlan, out: Path, workers: Workers, *, overwrite: bool, json: bool) -> None:
    from tomoskin.extras.labelled.shards import make_set

    n = plan.n_frames
    begun = time.monotonic()
    try:
        with Bar("drawing presses") as bar:
            made = make_set(plan, out, workers, bar, overwrite=overwrite)
    except KeyboardInterrupt:
        remark("stopped; the same command continues from here")
        raise typer.Exit(1) from None
    took = time.monotonic() - begun
    files = [str(file) for file in made.files]
    document = {"frames": n, "made": made.made, "found": made.kept, "files": files}
    before = f"; {made.kept} of {plan.n_shards} parts existed already" if made.kept else ""
    tell(document, [f"{out}: {n} labelled frames in {took:.1f} s{before}"], json=json)
