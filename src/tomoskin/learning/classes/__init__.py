"""Which class a frame belongs to, learnt from labelled examples: one of several, or flags."""
