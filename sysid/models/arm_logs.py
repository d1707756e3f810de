"""What logs of an arm must have in common, and its URDF."""

from collections.abc import Sequence

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.quantity import closest
from drake_disasm.common.resources import ONE_JOINT_MODELS, model_path
from drake_disasm.effects import Effect
from drake_disasm.logs import Log
from drake_disasm.logs.refusal import refusal


def arm_urdf(logs: Sequence[Log], urdf: str | None) -> str:
    """Returns the URDF that is given, or the one that the first log names.

    One joint whose motion was logged needs none.

    Raises:
        DisasmError: there is none.
    """
    where, remedy = logs[0].folder / "log.yaml", "give the arm's URDF by `urdf`"
    header = logs[0].header
    if not urdf and header.urdf is None:
        if header.kind == "joint_motion" and len(header.joints) == 1:
            return ONE_JOINT_MODELS["turns"]
        raise refusal(where, "no 'urdf'", remedy)
    urdf = str(urdf or header.urdf)
    model_path(urdf, f"{remedy}, or correct {where}")
    return urdf


def refuse_other_logs(logs: Sequence[Log], kind: str, model: str) -> None:
    """Refuses logs of another kind, or of other joints than the first.

    Args:
        logs: of an arm.
        kind: that they must be of.
        model: what needs it, for the message.

    Raises:
        DisasmError: there is such a log.
    """
    for log in logs:
        where, header = log.folder / "log.yaml", log.header
        if header.kind != kind:
            raise refusal(
                where,
                f"a log of kind '{header.kind}', {model} needs '{kind}'",
                "name such a log",
            )
        if header.joints != logs[0].header.joints:
            raise refusal(
                where, "other joints than in the first log", "fit it by itself"
            )


def refuse_other_joints(effects: Sequence[Effect], joints: Sequence[str]) -> None:
    """Refuses effects at joints that a log does not have.

    Raises:
        DisasmError: there is such an effect.
    """
    for number, effect in enumerate(effects):
        joint = getattr(effect, "joint", None)
        if joint is not None and joint not in joints:
            raise DisasmError(
                f"effects.{number}.joint: the log has no joint '{joint}'; "
                f"{closest(joint, list(joints))}"
            )
