"""GREIT: training targets, the operator trained on them, and figures of merit of any operator."""
