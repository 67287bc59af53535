"""A live server for Foxglove, in the schemas of session files."""
