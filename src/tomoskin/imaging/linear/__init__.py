"""Linear operators: one matrix, made once and applied per frame."""
