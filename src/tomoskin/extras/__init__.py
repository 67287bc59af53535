"""Features that are whole in a folder each: what one kind of user needs, and others can remove."""
