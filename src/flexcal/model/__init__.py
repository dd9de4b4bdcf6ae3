"""Robot model from URDF and robot.yaml, with forward maps and their exact derivatives."""
