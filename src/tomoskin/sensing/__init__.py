"""From counts to touches with an identity: signal, fit, segment, track."""
