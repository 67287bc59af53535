"""``tomoskin design``: what a skin can resolve before it is built."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tomoskin.cli import (
    DEFAULT_SKIN,
    FIGURE,
    Bar,
    ForceFlag,
    JsonFlag,
    NamedSkinOption,
    Writes,
    quantity,
    say_headroom,
    tables,
    tell,
)
from tomoskin.core import DataError, TomoskinError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from rich.table import Table

    from tomoskin.extras.design.bounds import Demand
    from tomoskin.model.skin import Skin

_ELECTRODES = "8,16,32"
_PATTERNS = "adjacent,skip:2,opposite"
_COARSE = 120
"""Places of each variant in the comparison; the skin's own map has more."""

_PLACES = 500

_HEADINGS = (
    *("pattern", "electrodes", "rows", "samples"),
    *("best mm", "median mm", "p95 mm", "faintest % p95", "saturates"),
)

_SATURATES = (
    "where it saturates, measurements are lost at this current and gain: --json says what would fit"
)


@dataclass(frozen=True)
class PressAsked:
    """The press that is to be resolved, and how surely it is to be noticed."""

    radius: Annotated[
        str | None,
        typer.Option(metavar='"15 mm"', help="Radius of the press. Default: 7.5 % of the sheet."),
    ] = None
    depth: Annotated[
        float, typer.Option(help="Part of the conductivity that the press takes away.")
    ] = 0.25
    false_alarm: Annotated[
        float, typer.Option(help="Probability of a false alarm at a position, in a frame.")
    ] = 1e-4
    detected: Annotated[
        float, typer.Option("--found", help="Probability that a press is detected in a frame.")
    ] = 0.95

    def of(self, skin: Skin) -> Demand:
        """On a ``skin``; DataError for a press that covers the sheet, which has no place."""
        import numpy as np

        from tomoskin.extras.design.bounds import Demand

        radius = quantity(self.radius, "length", "--radius") if self.radius else None
        most = float(np.ptp(skin.mesh().points, axis=0)[:2].min()) / 2
        if radius is not None and radius >= most:
            raise DataError(
                f"expected a radius below {1e3 * most:.0f} mm, half of the sheet, got "
                f"{1e3 * radius:.0f} mm",
                where="--radius",
            )
        return Demand(radius, self.depth, self.false_alarm, self.detected)


def design(
    skin: NamedSkinOption = DEFAULT_SKIN,
    out: Annotated[
        Path | None,
        typer.Option(metavar="MAP.png", help="File for the map of the skin."),
        Writes(FIGURE),
    ] = None,
    *,
    press: PressAsked,
    electrodes: Annotated[
        str, typer.Option(metavar="N,N", help='Numbers of electrodes to compare; "" compares none.')
    ] = _ELECTRODES,
    patterns: Annotated[
        str, typer.Option(metavar="NAME,NAME", help="Patterns to compare, named as in a skin file.")
    ] = _PATTERNS,
    force: ForceFlag = False,
    json: JsonFlag = False,
) -> None:
    """Predict what a skin can resolve before it is built.

    Bounds of the skin, compared with variants.

    The bounds are for the position of a press and for the faintest press, with the skin's own
    read-out. No method can do better without more knowledge (Cramér–Rao).
    """
    from tomoskin.extras.design.bounds import resolution_bounds
    from tomoskin.extras.design.design_map import write_promise
    from tomoskin.model.skin import Skin
    from tomoskin.pipeline import ambiguity_of

    counts = _counts(electrodes)
    chosen = Skin.load(skin)
    demand = press.of(chosen)
    with Bar("bounding") as bar:
        jobs = 1 + len(counts) * len(patterns.split(","))
        own = resolution_bounds(chosen, demand, _PLACES, _part(bar, 0, jobs))
        rows = _compared(chosen, demand, counts, patterns.split(","), bar)
    radius_m = demand.on(chosen.mesh())
    say_headroom(own.headroom)
    ambiguity = ambiguity_of(chosen)
    document = {
        "skin": chosen.name,
        "press": {"radius_m": radius_m, "depth": press.depth},
        "false_alarm": press.false_alarm,
        "found": press.detected,
        **own.figures(),
        "ambiguity": None if ambiguity is None else ambiguity.text,
        "compared": rows,
    }
    tell(document, _lines(document), json=json)
    if out is not None:  # last: what may fail must not cost the table
        title = (
            f"{chosen.name}: one frame, press of radius {1e3 * radius_m:.0f} mm taking "
            f"{100 * press.depth:.0f} %; noticed: {100 * press.detected:g} % found, "
            f"{press.false_alarm:g} false alarms"
        )
        write_promise(out, chosen, own, title, overwrite=force)


def _counts(text: str) -> list[int]:
    parts = [part.strip() for part in text.split(",") if part.strip()]
    if not all(part.isdigit() for part in parts):
        raise typer.BadParameter(f'expected whole numbers such as 8,16, got "{text}"')
    return [int(part) for part in parts]


def _part(bar: Bar, number: int, jobs: int) -> Callable[[float, float], None]:
    """Progress of one job of several."""
    return lambda done, total: bar(number + done / total, jobs)


def _compared(
    skin: Skin, demand: Demand, counts: list[int], patterns: list[str], bar: Bar
) -> list[dict[str, Any]]:
    from tomoskin.extras.design.bounds import resolution_bounds, variants
    from tomoskin.model.pattern import Scan
    from tomoskin.pipeline import ambiguity_of

    rows: list[dict[str, Any]] = []
    jobs = 1 + len(counts) * len(patterns)
    for number, variant in enumerate(variants(skin, counts, patterns), start=1):
        row: dict[str, Any] = {"electrodes": variant.electrodes, "pattern": variant.pattern}
        if variant.skin is None:
            rows.append(row | {"fault": variant.fault})
            continue
        try:
            bound = resolution_bounds(variant.skin, demand, _COARSE, _part(bar, number, jobs))
        except TomoskinError as error:
            rows.append(row | {"fault": error.message})
            continue
        ambiguous = ambiguity_of(variant.skin)
        row["ambiguity"] = None if ambiguous is None else ambiguous.text
        pattern = variant.skin.pattern()
        samples = Scan.of(pattern).n_samples
        row |= {"rows": pattern.n_meas, "samples": samples} | bound.figures()
        if (problem := bound.headroom.problem) is not None:
            row["saturated"] = problem
        rows.append(row)
    return rows


def _lines(document: dict[str, Any]) -> Iterator[str | Table]:
    press = document["press"]
    yield (
        f"{document['skin']}: a press of radius {1e3 * press['radius_m']:.0f} mm that takes "
        f"{100 * press['depth']:.0f} % of the conductivity, in one frame, within 85 % of the way "
        "to the rim:"
    )
    yield (
        f"the RMS error of its position is at least {1e3 * document['least_m']:.2g} mm at the "
        f"best position, {1e3 * document['median_m']:.2g} mm in the median, "
        f"{1e3 * document['p95_m']:.2g} mm at the 95th percentile"
    )
    if document["ambiguity"] is not None:
        yield f"but {document['ambiguity']}"
    yield (
        f"it is detected (found {100 * document['found']:g} % of the time, "
        f"{document['false_alarm']:g} false alarms) from "
        f"{100 * document['faintest_median']:.2g} % on in the median, "
        f"{100 * document['faintest_p95']:.2g} % at the 95th percentile"
    )
    shown = [
        (
            *(row["pattern"], row["electrodes"], row["rows"], row["samples"]),
            *(f"{1e3 * row[key]:.2g}" for key in ("least_m", "median_m", "p95_m")),
            f"{100 * row['faintest_p95']:.2g}",
            "yes" if "saturated" in row else "",
        )
        for row in document["compared"]
        if "fault" not in row
    ]
    if shown:
        yield from tables("the same sheet with another design", _HEADINGS, shown)
    if any("saturated" in row for row in document["compared"]):
        yield _SATURATES
    for row in document["compared"]:
        if fault := row.get("fault") or row.get("ambiguity"):
            yield f"{row['electrodes']} electrodes, {row['pattern']}: {fault}"
