"""Where a touch is, learnt from labelled presses, or from touches everywhere without labels."""
