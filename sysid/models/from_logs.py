"""The model for each kind of log."""

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.logs import Log
from drake_disasm.scenario import Scenario, scenario_from_mapping
from sysid.models.base import LogModel
from sysid.models.contact import ContactModel
from sysid.models.joint_motion import JointMotionModel
from sysid.models.joint_torque_static import JointTorqueStaticModel
from sysid.models.response.model import JointResponseModel
from sysid.models.static_wrench import DEFAULT_PARAMETERS, StaticWrenchModel
from sysid.models.twin import TwinModel
from sysid.scenario_parameters import ParameterRequest, scenario_parameters

#: What is compared, by the kind of log; the first is the default.
OBJECTIVES = {
    "transitions": ("transitions", "rollout"),
    "static_wrench": ("static_wrench",),
    "contact": ("contact",),
    "joint_motion": ("joint_motion",),
    "joint_torque_static": ("joint_torque_static",),
    "joint_response": ("joint_response",),
}


@dataclass(frozen=True)
class ModelChoice:
    """What a user chooses of the model, apart from the logs.

    Attributes:
        objective: one of OBJECTIVES for the kind of log; None for the default.
        scenario: nominal; None for the one stated in the log.
        requests: parameters to vary; none stands for the default ones of the kind.
        urdf: of the arm; None for the one named in the log.
        noise: standard deviations of channels, by name, instead of the model's, SI.
        fixed: whether a twin may have no parameter to vary.
        trust_urdf: whether the rigid bodies of an arm are the URDF's.
    """

    objective: str | None = None
    scenario: Scenario | None = None
    requests: tuple[ParameterRequest, ...] = ()
    urdf: str | None = None
    noise: tuple[tuple[str, float], ...] = ()
    fixed: bool = False
    trust_urdf: bool = False


def model_of(logs: Sequence[Log], choice: ModelChoice) -> LogModel:
    """Returns the model that predicts the channels of some logs of one kind.

    Raises:
        DisasmError: the objective is not for this kind of log, a parameter does not
            exist, or a log lacks what the model needs.
    """
    kind = logs[0].header.kind
    objective = choice.objective or OBJECTIVES[kind][0]
    if objective not in OBJECTIVES[kind]:
        raise DisasmError(
            f"`objective` {objective}: {logs[0].folder} is a log of kind '{kind}'; "
            f"for that use {' or '.join(OBJECTIVES[kind])}"
        )
    make = {
        "static_wrench": _static_wrench,
        "contact": _contact,
        "joint_motion": _joint_torques,
        "joint_torque_static": _joint_torques,
        "joint_response": _joint_response,
    }
    if choice.trust_urdf and make.get(kind) is not _joint_torques:
        raise DisasmError(
            f"{logs[0].folder}: a log of kind '{kind}' has no rigid bodies to "
            "identify; `trust_urdf` is for joint_motion and joint_torque_static"
        )
    model = make.get(kind, _twin)(logs, choice)
    return _with_noise(model, dict(choice.noise))


def stated_scenario(logs: Sequence[Log]) -> Scenario | None:
    """Returns the scenario that the first log states, if it states one."""
    mapping = logs[0].header.scenario
    return scenario_from_mapping(dict(mapping)) if mapping else None


def _twin(logs: Sequence[Log], choice: ModelChoice) -> LogModel:
    scenario = choice.scenario or stated_scenario(logs)
    if scenario is None:
        raise DisasmError(
            f"{logs[0].folder}: states no scenario; name the twin's nominal one by "
            "`scenario`"
        )
    if not (choice.requests or choice.fixed):
        raise DisasmError(
            "no parameters to identify; name them by `parameters`, for example "
            "contact.friction part.clearance GroovePose.ry"
        )
    scenario, parameters = scenario_parameters(scenario, choice.requests)
    rollout = choice.objective == "rollout"
    return TwinModel(logs, scenario, parameters, rollout)


def _static_wrench(logs: Sequence[Log], choice: ModelChoice) -> LogModel:
    return _readings(StaticWrenchModel, logs, choice)


def _contact(logs: Sequence[Log], choice: ModelChoice) -> LogModel:
    return _readings(ContactModel, logs, choice)


def _readings(
    kind: type[StaticWrenchModel], logs: Sequence[Log], choice: ModelChoice
) -> LogModel:
    requests = choice.requests or tuple(ParameterRequest(n) for n in DEFAULT_PARAMETERS)
    known = choice.scenario or stated_scenario(logs)
    scenario, parameters = scenario_parameters(known or Scenario(), requests)
    return kind(logs, scenario, parameters, known is not None)


def _joint_torques(logs: Sequence[Log], choice: ModelChoice) -> LogModel:
    known = choice.scenario or stated_scenario(logs)
    is_rest = logs[0].header.kind == JointTorqueStaticModel.kind
    make = JointTorqueStaticModel if is_rest else JointMotionModel
    model = make(logs, choice.urdf, known)
    names = [request.name for request in choice.requests]
    model = model.only(names) if names else model
    return model.trusting_urdf() if choice.trust_urdf else model


def _joint_response(logs: Sequence[Log], choice: ModelChoice) -> LogModel:
    known = choice.scenario or stated_scenario(logs)
    return JointResponseModel(logs, choice.urdf, known)


def _with_noise(model: LogModel, noise: dict[str, float]) -> LogModel:
    """Returns the model with the noise of some channels as given."""
    known = [channel.name for channel in model.measurements.channels]
    for name, value in noise.items():
        if name not in known:
            raise DisasmError(
                f"`noise` {name}: no such channel, the model does not predict it; "
                f"{closest(name, known)}"
            )
        if not 0.0 < value < math.inf:
            raise DisasmError(f"`noise` {name}={value:g}: give a number above zero")
    channels = tuple(
        dataclasses.replace(channel, noise=noise[channel.name], origin="as given")
        if channel.name in noise
        else channel
        for channel in model.measurements.channels
    )
    measurements = dataclasses.replace(model.measurements, channels=channels)
    return model.with_measurements(measurements)
