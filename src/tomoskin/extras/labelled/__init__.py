"""Labelled frames by the thousand: presses at random on the twin, by processes or machines."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tomoskin.core import later

if TYPE_CHECKING:
    from tomoskin.extras.labelled.population import (
        COMMON_PRESSES as COMMON_PRESSES,
        Population as Population,
        PressesSection as PressesSection,
        SetPlan as SetPlan,
        make_shard as make_shard,
    )
    from tomoskin.extras.labelled.shards import (
        in_processes as in_processes,
        in_this_process as in_this_process,
        make_set as make_set,
        on_cluster as on_cluster,
    )

__getattr__ = later(__name__, "population", "shards")
