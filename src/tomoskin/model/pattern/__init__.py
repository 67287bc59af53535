"""Drive and measurement tables: THE order of the rows, shared by firmware, decoder and Jacobian."""

from tomoskin.model.pattern.pattern import (
    Pattern as Pattern,
    check_drives as check_drives,
    electrodes_of as electrodes_of,
    named as named,
    signed as signed,
    undirected as undirected,
)
from tomoskin.model.pattern.rows import (
    RECIPROCALS as RECIPROCALS,
    Scan as Scan,
    match_rows as match_rows,
    sum_rows as sum_rows,
)
