"""Nested dataclasses of arrays that have a row for each environment."""

import dataclasses
import itertools
from collections.abc import Callable, Mapping
from typing import Any, TypeVar

from pydrake.math import RigidTransform

from drake_disasm.common.arrays import Array, array_like
from drake_disasm.common.rotations import Pose

_Tree = TypeVar("_Tree")


def mapped(function: Callable[..., Array], tree: _Tree, *others: _Tree) -> _Tree:
    """Returns a dataclass with a function of its arrays in their places.

    Args:
        function: of an array, and those of the others in the same place.
        tree: arrays, or dataclasses of them; anything else stays as it is.
        others: of the same structure.
    """
    if isinstance(tree, RigidTransform):
        tree, *others = (Pose.of(X) for X in (tree, *others))  # type: ignore[assignment]
    if dataclasses.is_dataclass(tree) and not isinstance(tree, type):
        fields = [field.name for field in dataclasses.fields(tree)]
        fresh = {
            name: mapped(function, *(getattr(t, name) for t in (tree, *others)))
            for name in fields
        }
        return type(tree)(**fresh)
    if hasattr(tree, "shape") or isinstance(tree, float | int):
        return function(tree, *others)
    if isinstance(tree, tuple):
        parts = zip(tree, *others, strict=True)
        return type(tree)(mapped(function, *p) for p in parts)
    return tree


def shared(tree: _Tree, like: Array) -> _Tree:
    """Returns a dataclass with its arrays of another kind; numbers stay numbers.

    Args:
        tree: of NumPy's arrays.
        like: of the kind that is wanted.
    """
    return mapped(
        lambda leaf: leaf if _is_number(leaf) else array_like(leaf, like), tree
    )


def leaves_of(tree: Any) -> list[Any]:
    """Returns the arrays and numbers of a dataclass, in their order."""
    found: list[Any] = []

    def note(leaf: Any) -> Any:
        """Notes an array."""
        found.append(leaf)
        return leaf

    mapped(note, tree)
    return found


def with_leaves(tree: _Tree, leaves: Mapping[int, Array]) -> _Tree:
    """Returns a dataclass with other arrays in some places.

    Args:
        tree: of arrays and numbers.
        leaves: by their number in `leaves_of`.
    """
    numbers = itertools.count()
    return mapped(lambda leaf: leaves.get(next(numbers), leaf), tree)


def rows_of(tree: _Tree, rows: Any) -> _Tree:
    """Returns some rows of each array."""
    return mapped(lambda leaf: leaf[rows], tree)


def put_rows(tree: Any, rows: Any, other: Any) -> None:
    """Overwrites some rows of each array, in place, by those of another dataclass."""

    def put(leaf: Array, new: Array) -> Array:
        """Overwrites rows of an array."""
        leaf[rows] = new
        return leaf

    mapped(put, tree, other)


def _is_number(leaf: Any) -> bool:
    return isinstance(leaf, float | int)
