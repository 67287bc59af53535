"""Files: sessions, imports of other formats, exports to them."""
