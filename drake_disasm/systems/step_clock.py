"""The time of a discrete plant's newest step."""

from pydrake.systems.framework import BasicVector, Context, LeafSystem

from drake_disasm.common.timing import newest_step


class StepClock(LeafSystem):
    """Puts out the time of the newest sample: the plant's newest step [s].

    @system
    name: StepClock
    output_ports:
    - time
    @endsystem

    Args:
        time_step: of the plant [s].
    """

    def __init__(self, time_step: float) -> None:
        super().__init__()
        self._time_step = time_step
        self.DeclareVectorOutputPort(
            "time", 1, self._calc, prerequisites_of_calc={self.time_ticket()}
        )

    def _calc(self, context: Context, output: BasicVector) -> None:
        output.SetFromVector([newest_step(context.get_time(), self._time_step)])
