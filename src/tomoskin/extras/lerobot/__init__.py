"""Sessions as datasets of LeRobot, and touch in the forms in which policies take it."""
