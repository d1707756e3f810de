"""Which experiment would separate effects that a log can't tell apart."""

#: What shows each effect apart from others: one recording for each.
_SHOWN_BY = {
    "SensorBias": "readings in six or more orientations, which turn the weight but "
    "not an offset",
    "SensorDrift": "the first pose again at the end, and a rest of some minutes",
    "SensorWarmUp": "a rest from switching on until the reading stays, pose unchanged",
    "SensorGain": "known weights of several sizes, along each axis of the sensor",
    "SensorCrossTalk": "a known weight along one axis of the sensor at a time",
    "SensorMounting": "the same poses with two known weights, gravity along each axis "
    "of the sensor in turn",
    "SensorLag": "fast motion and slow motion over the same path",
    "SensorHysteresis": "loading and unloading along one axis, in small steps",
    "SensorSaturation": "loads near the end of the range, along each axis",
    "PayloadError": "six or more orientations, with and without the tool",
    "BaseTilt": "the same orientations of the sensor with the arm's base turned",
    "JointViscousFriction": "this joint at three or more constant speeds, both ways",
    "JointCoulombFriction": "this joint at three or more constant speeds, both ways",
    "JointStribeckFriction": "this joint at constant speeds below 0.1 rad/s, both ways",
    "JointAsymmetricFriction": "this joint both ways at the same speeds, with rests",
    "JointLoadFriction": "the same motion with two payloads",
    "TorqueOffset": "rests of this joint in several poses, each reached from both "
    "sides",
    "TorqueGain": "the same motion with two known payloads",
    "RotorInertia": "fast reversals of this joint alone, the others at rest",
    "FlangePayload": "rests in several poses, with and without what hangs there",
    "GroovePose": "pulls in both directions, the bolt turned by a known angle between",
    "GrooveBend": "slow pulls over the whole groove, both ways and along both walls",
    "GrooveClearance": "small steps sideways from wall to wall, at several depths",
    "GrooveFriction": "pulls both ways against one wall under two normal forces",
    "GrooveViscousFriction": "pulls under one normal force at three or more speeds",
    "GrooveStribeckFriction": "pulls under one normal force, from very slow to fast",
    "RustyPatch": "slow pulls over the whole groove, both ways, under one normal force",
    "ContactStiffness": "slow presses against one wall, up to three forces or more",
    "ContactExponent": "slow presses against one wall, from light to strong",
    "ChainPull": "the same pull both ways: a chain keeps its sign, friction does not",
    "CommandGain": "steps of several lengths in free space",
    "MotionLag": "fast and slow steps over the same path in free space",
    "Backlash": "reversals after long and short steps, in free space and under load",
    "Compliance": "the same steps under two loads",
    "BoltSlip": "a strong pull and back: slip stays, compliance returns",
}

#: What separates pairs that are often mistaken for each other.
_PAIRS = {
    ("SensorDrift", "SensorWarmUp"): "a longer rest: a warm-up ends, a drift goes on",
    ("SensorGain", "PayloadError"): "the same poses with a second, known weight: an "
    "error of the payload stays, one of the gain grows",
    (
        "SensorMounting",
        "BaseTilt",
    ): "the arm's base, or its first joint, turned: a tilt "
    "is fixed to the world, the mounting to the sensor",
    ("SensorCrossTalk", "SensorMounting"): "a known weight along one axis at a time: "
    "turned axes mix antisymmetrically",
    ("JointCoulombFriction", "JointViscousFriction"): "three or more constant speeds",
    ("JointCoulombFriction", "JointLoadFriction"): "the same motion with two payloads",
    ("JointAsymmetricFriction", "TorqueOffset"): "rests: an offset is there at rest",
    ("JointStribeckFriction", "JointCoulombFriction"): "slow ramps through zero speed",
    ("GrooveFriction", "GroovePose"): "the same pull both ways: friction changes its "
    "sign, geometry does not",
    ("Backlash", "Compliance"): "the same reversals under two loads: backlash does not "
    "grow",
}


def separating(one: str, other: str) -> str:
    """Returns the experiment that tells two effects apart, in words.

    Args:
        one, other: names of effects, each with its joint if it has one, or with
            several joined by "and".
    """
    kinds = [_kinds(one), _kinds(other)]
    for pair, experiment in _PAIRS.items():
        if [[pair[0]], [pair[1]]] in (kinds, kinds[::-1]):
            return experiment
    shown = [_SHOWN_BY[k] for k in dict.fromkeys(kinds[0] + kinds[1]) if k in _SHOWN_BY]
    return (
        "; ".join(dict.fromkeys(shown)) or "a recording with only one of them at work"
    )


def _kinds(name: str) -> list[str]:
    """Returns the classes of effects that a name speaks of."""
    return [part.partition(".")[0] for part in name.split(" and ")]
