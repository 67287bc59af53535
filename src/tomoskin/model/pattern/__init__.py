"""Drive and measurement tables: THE order of the rows, shared by firmware, decoder and Jacobian."""

from tomoskin.model.pattern.match import RowMatch, match_rows
from tomoskin.model.pattern.pattern import NAMED, Pattern, named, undirected
from tomoskin.model.pattern.scan import Scan

__all__ = ["NAMED", "Pattern", "RowMatch", "Scan", "match_rows", "named", "undirected"]
