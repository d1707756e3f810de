"""Whether to put a policy on the robot, judged on the corrected twin."""
