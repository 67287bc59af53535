"""Recordings, images and touches in the formats of other programs; pictures and films."""

from tomoskin.files.exports.curves import write_choices as write_choices
from tomoskin.files.exports.export import Export as Export, ExportFormat as ExportFormat
from tomoskin.files.exports.picture import (
    FILMS as FILMS,
    MOST_PANELS as MOST_PANELS,
    Display as Display,
    Panel as Panel,
    dress as dress,
    new_figure as new_figure,
    plot as plot,
    save_figure as save_figure,
    write_picture as write_picture,
)
from tomoskin.files.exports.session_export import (
    WRITERS as WRITERS,
    export_deformations as export_deformations,
    export_formats as export_formats,
    export_touches as export_touches,
    omitted as omitted,
)
from tomoskin.files.exports.session_table import (
    write_deformations as write_deformations,
    write_touches as write_touches,
)
from tomoskin.files.exports.vtu import series_files as series_files, write_vtu as write_vtu
