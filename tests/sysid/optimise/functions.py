"""The standard test functions (Pham and Castellani 2009), values of a batch."""

import numpy as np


def sphere(x):
    return np.sum(x**2, axis=1)


def rosenbrock(x):
    return np.sum(
        100.0 * (x[:, 1:] - x[:, :-1] ** 2) ** 2 + (1 - x[:, :-1]) ** 2, axis=1
    )


def ackley(x):
    n = x.shape[1]
    root = np.sqrt(np.sum(x**2, axis=1) / n)
    waves = np.sum(np.cos(2 * np.pi * x), axis=1) / n
    return 20 + np.e - 20 * np.exp(-0.2 * root) - np.exp(waves)


def rastrigin(x):
    return np.sum(x**2 - 10 * np.cos(2 * np.pi * x) + 10, axis=1)


def griewank(x):
    i = np.sqrt(np.arange(1, x.shape[1] + 1))
    return 1 + np.sum(x**2, axis=1) / 4000 - np.prod(np.cos(x / i), axis=1)


#: Function, half width of the box, dimensions; all have the minimum 0.
STANDARD = {
    "sphere": (sphere, 100.0, 6),
    "rosenbrock": (rosenbrock, 2.0, 4),
    "ackley": (ackley, 32.0, 4),
    "rastrigin": (rastrigin, 5.12, 3),
    "griewank": (griewank, 100.0, 3),
}
