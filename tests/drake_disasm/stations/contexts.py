"""What tests compare of two Contexts of a system."""

import numpy as np
from pydrake.systems.framework import Context


def numbers(context: Context) -> np.ndarray:
    """Returns all of a Context's time, discrete state and numeric parameters."""
    state = [
        context.get_discrete_state(i).value()
        for i in range(context.num_discrete_state_groups())
    ]
    parameters = [
        context.get_numeric_parameter(i).CopyToVector()
        for i in range(context.num_numeric_parameter_groups())
    ]
    return np.concatenate([[context.get_time()], *state, *parameters])
