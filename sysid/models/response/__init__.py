"""How an arm answers its commands: a drive at each joint, simulated forward.

Drake computes the rigid bodies; the drive, friction and other effects act on them in an
integrator that takes many segments of a log, and many parameter sets, side by side.
"""
