"""Played devices: an OnRobot Compute Box, a Robotiq gripper, an arm behind LCM."""
