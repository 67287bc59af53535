"""``tomoskin simulate``: the twin follows a script, or makes labelled frames."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tomoskin.cli.choices import say_headroom
from tomoskin.cli.named_files import RECORDING, ForceFlag, Given, Reads, Writes
from tomoskin.cli.options import DEFAULT_SKIN, NamedSkinOption
from tomoskin.cli.output import Bar, JsonFlag, remark, tell
from tomoskin.core import Output

if TYPE_CHECKING:
    from tomoskin.model.skin import Skin
    from tomoskin.run import Workers
    from tomoskin.twin import SetPlan

ONE_FILE = {".npz": "labelled frames in one file"}


def _simulated(out: Path | None, given: Given, called: str) -> list[Output]:
    """A session; or labelled frames, of which a folder that is there is looked into later."""
    assert out is not None
    if given["presses"] is None:
        return [Output(out, RECORDING, called)]
    if out.is_dir() and out.suffix.lower() != ".npz":
        return []
    endings = ONE_FILE if out.exists() else ONE_FILE | {"": "a folder of them"}
    return [Output(out, endings, called, makes_folders=True)]


@dataclass(frozen=True)
class WorkersAsked:
    """The processes or machines that make labelled frames."""

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

    @property
    def some(self) -> bool:
        """Whether processes or machines are named."""
        return self.processes is not None or self.cluster is not None

    def of(self) -> Workers:
        """Those processes or machines; one process for each processor where none are named."""
        from tomoskin.run import in_processes, in_this_process, on_cluster, processors

        if self.cluster is not None:
            if self.processes is not None:
                raise typer.BadParameter(
                    "cannot be combined with --cluster", param_hint="--processes"
                )
            return on_cluster(self.cluster)
        n = self.processes or processors()
        return in_this_process if n == 1 else in_processes(n)


def simulate(
    *,
    skin: NamedSkinOption = DEFAULT_SKIN,
    script: Annotated[
        Path | None,
        typer.Option(metavar="X.toml", help="Script of the presses and faults (docs/simulate.md)."),
        Reads(),
    ] = None,
    out: Annotated[
        Path,
        typer.Option(help="Session file; with --presses a folder or FILE.npz."),
        Writes(RECORDING | ONE_FILE, _simulated),
    ],
    presses: Annotated[
        int | None,
        typer.Option(
            min=1,
            metavar="N",
            help="Simulate N labelled frames of random presses instead of a recording.",
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="Seed of all noise; it overrides the script's. The same seed gives the same data.",
        ),
    ] = None,
    workers: WorkersAsked,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Check which of the two is asked for, and do it."""
    from tomoskin.model.skin import Skin
    from tomoskin.sensing.signal import Headroom

    chosen = Skin.load(skin)
    say_headroom(Headroom.of_skin(chosen))
    if presses is not None:
        plan = _plan(chosen, script, seed or 0, presses)
        _labelled(plan, out, workers.of(), overwrite=force, json=json)
        return
    if script is None:
        raise typer.BadParameter(
            "expected --script FILE or --presses N, got neither", param_hint="--script"
        )
    if workers.some:
        raise typer.BadParameter(
            "has an effect only with --presses", param_hint="--processes, --cluster"
        )
    _timeline(chosen, script, out, seed, json=json)


def _timeline(skin: Skin, script: Path, out: Path, seed: int | None, *, json: bool) -> None:
    from tomoskin.model.skin import read_text
    from tomoskin.run import simulate as run
    from tomoskin.twin import Script

    read = Script.from_toml(read_text(script, "a script"), source=str(script))
    begun = time.monotonic()
    try:
        with Bar("simulating") as bar:
            made = run(read, skin, out, seed=seed, advance=bar)
    except KeyboardInterrupt:
        remark(f"stopped; {out} holds the simulation until then, and says that it was stopped")
        raise typer.Exit(1) from None
    took = time.monotonic() - begun
    document = {
        "out": str(out), "frames": made.frames, "lost": made.lost, "seconds": made.seconds,
    }  # fmt: skip
    lost = f", {made.lost} lost on the line" if made.lost else ""
    line = f"{out}: {made.frames} frames{lost}, {made.seconds:g} s of the skin in {took:.1f} s"
    tell(document, [line], json=json)


def _plan(skin: Skin, script: Path | None, seed: int, n: int) -> SetPlan:
    from tomoskin.model.skin import read_text
    from tomoskin.twin import COMMON_PRESSES, Population, SetPlan, check_settling

    population = COMMON_PRESSES
    if script is not None:
        population = Population.from_toml(read_text(script, "a script"), source=str(script))
    preset = population.preset or skin.twin.preset
    check_settling(skin, preset)
    return SetPlan(skin.to_toml(), population, preset, seed, n)


def _labelled(plan: SetPlan, out: Path, workers: Workers, *, overwrite: bool, json: bool) -> None:
    from tomoskin.run import make_set

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
    document = {"frames": n, "made": made.made, "found": made.found, "files": files}
    before = f"; {made.found} of {plan.n_shards} parts existed already" if made.found else ""
    tell(document, [f"{out}: {n} labelled frames in {took:.1f} s{before}"], json=json)
