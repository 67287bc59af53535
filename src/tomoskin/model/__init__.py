"""What is there and what it reads: mesh, pattern, skin, robot, forward model."""
