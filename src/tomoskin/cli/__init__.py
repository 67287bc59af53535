"""The command line: one module a command, and one line in ``app`` for each; what extras make theirs
of."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tomoskin.cli.app import group as group, main as main
from tomoskin.cli.named_files import (
    FIGURE as FIGURE,
    SKIN as SKIN,
    TABLE as TABLE,
    Added as Added,
    ForceFlag as ForceFlag,
    Given as Given,
    Otherwise as Otherwise,
    Reads as Reads,
    Writes as Writes,
)
from tomoskin.core import later

if TYPE_CHECKING:
    from tomoskin.cli.calibrate_labels import (
        labelled_arrays as labelled_arrays,
        labels_of_frames as labels_of_frames,
    )
    from tomoskin.cli.choices import (
        chosen_sinks as chosen_sinks,
        quantity as quantity,
        say_headroom as say_headroom,
        skin_for_source as skin_for_source,
    )
    from tomoskin.cli.learning_command import (
        LearningOutcome as LearningOutcome,
        calibration_command as calibration_command,
    )
    from tomoskin.cli.live import Served as Served, hub_of as hub_of
    from tomoskin.cli.named_parts import (
        Recorded as Recorded,
        found_touches as found_touches,
        say_scale as say_scale,
    )
    from tomoskin.cli.options import (
        DEFAULT_SKIN as DEFAULT_SKIN,
        ImageOptions as ImageOptions,
        KnownSkinOption as KnownSkinOption,
        NamedSkinOption as NamedSkinOption,
        RecordingArgument as RecordingArgument,
        ReferenceOption as ReferenceOption,
        SameSkinOption as SameSkinOption,
        SimulateOptions as SimulateOptions,
        SkinArgument as SkinArgument,
    )
    from tomoskin.cli.output import (
        Bar as Bar,
        JsonFlag as JsonFlag,
        remark as remark,
        tables as tables,
        tell as tell,
    )
    from tomoskin.cli.record import troubles_told as troubles_told

__getattr__ = later(
    __name__,
    *("options", "output", "choices", "named_parts", "learning_command", "calibrate_labels"),
    *("record", "live"),
)
