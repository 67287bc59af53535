"""Parameter choice: which alpha, by which criterion, and why."""
