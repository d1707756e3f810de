"""Motions of the arm away from the lock, played on the cell, simulated or real.

From `motion.csv` of `drake-disasm excite` to a log of kind `joint_response`: the bolt
is taken out of the groove, the arm goes to where the motion begins, and plays it.

Modules:
    table     a motion as a table of joint positions, checked against the arm's limits
    fourier, rest_to_rest   periodic motions, and straight ways
    arm_limits, arm_space   where an arm may go, and where its motions begin
    way       from the start of the task to where a motion begins
    playing   the diagram that plays it, and what was commanded and measured
    recording the log of it
    cell_urdf the URDF of arm and tool, which a log of the motion names
"""
