"""The Bees Algorithm (Pham et al. 2006; thesis, algorithm 4.1), for minimisation.

Scouts sample the whole box; the best sites recruit foragers that search their
neighbourhoods; a site that does not improve shrinks its neighbourhood and loses a
life, and without lives it is abandoned.

    bees = BeesAlgorithm(Box.of([-5, -5], [5, 5]), BeesSettings(), seed=1)
    trace = bees.run(lambda x: (x**2).sum(axis=1), cycles=50)
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import read_json, write_json
from drake_disasm.common.text import clipped
from sysid.optimise.coordinates import BatchFunction, Box
from sysid.optimise.trace import Trace

Array = NDArray[np.float64]


_REMEDY = "delete it to start anew"
_SITE = {"centre": [0.0], "value": 0.0, "edge": [0.0], "lives": 0}
_TRACE = {"points": [[0.0]], "values": [0.0], "cycle_ends": [0], "stopped": ""}
#: What a checkpoint holds, besides the search's identity.
_STATE = {"sites": [_SITE], "trace": _TRACE, "generator": {}}


@dataclass(frozen=True)
class BeesSettings:
    """The colony; the defaults suit most searches of some hundred evaluations.

    Attributes:
        scouts: ns, bees that search globally in each cycle, in addition to the sites.
        sites: nb, best sites that are searched locally.
        recruits: nr, foragers of each of those.
        elite_sites: ne, the best of the best, with more foragers.
        elite_recruits: nre, foragers of each elite site.
        stagnation_limit: stlim, cycles without improvement before a site is abandoned.
        shrink: alpha, factor on the neighbourhood of a site that did not improve.
        neighbourhood: ngh, edge of a new site's neighbourhood over the box's.
    """

    scouts: int = 4
    sites: int = 3
    recruits: int = 3
    elite_sites: int = 1
    elite_recruits: int = 6
    stagnation_limit: int = 5
    shrink: float = 0.7
    neighbourhood: float = 0.5

    @classmethod
    def thesis(cls) -> Self:
        """Returns the settings of table 4.2 (ngh is not stated: the whole box)."""
        return cls(2, 2, 2, 0, 0, 2, 0.5, 1.0)

    def __post_init__(self) -> None:
        """Refuses settings that contradict each other."""
        for name in ("sites", "recruits", "stagnation_limit"):
            if getattr(self, name) < 1:
                raise DisasmError(f"bees: {name} must be at least 1")
        if min(self.scouts, self.elite_sites, self.elite_recruits) < 0:
            raise DisasmError("bees: scouts and elites can't be negative")
        if self.elite_sites > self.sites:
            raise DisasmError("bees: there are more elite_sites than sites; give fewer")
        if self.elite_sites and not self.elite_recruits:
            raise DisasmError("bees: elite_sites without elite_recruits; give some")
        if not (0.0 < self.shrink < 1.0 and 0.0 < self.neighbourhood <= 1.0):
            raise DisasmError("bees: shrink and neighbourhood are between 0 and 1")

    def foragers(self, rank: int) -> int:
        """Returns how many foragers the site of a rank gets, the best being 0."""
        return self.elite_recruits if rank < self.elite_sites else self.recruits

    @property
    def per_cycle(self) -> int:
        """Evaluations of one cycle."""
        return self.scouts + sum(self.foragers(rank) for rank in range(self.sites))

    @property
    def initial(self) -> int:
        """Evaluations before the first cycle: ns + nr nb (line 1)."""
        return self.per_cycle


@dataclass
class Site:
    """A place that is searched locally.

    Attributes:
        centre: (p,) the best point found there.
        value: of the function at it.
        edge: (p,) edge lengths of its neighbourhood.
        lives: cycles without improvement that it has left.
    """

    centre: Array
    value: float
    edge: Array
    lives: int


@dataclass(frozen=True)
class Stop:
    """When to end: at the first criterion that is met.

    Attributes:
        cycles: number of cycles.
        evaluations: maximum; no cycle begins that would exceed it.
        value: of the function that is good enough.
        stagnation: cycles without a better value than this many cycles ago.
    """

    cycles: int | None = None
    evaluations: int | None = None
    value: float = -math.inf
    stagnation: int | None = None


#: Further points (k, p) to try in the next cycle, from what was tried so far; such
#: as a surrogate's proposals. They take the place of scouts.
Propose = Callable[[Trace, Box, int, np.random.Generator], Array]


class BeesAlgorithm:
    """One search, whose whole state can be written to a file and resumed.

    All points of a cycle, of sites and of scouts, are evaluated in one batch. Where
    the thesis's algorithm leaves a choice: the best site shrinks, too (line 7 read
    literally would leave it searching the whole box), but is never abandoned; an
    abandoned site is replaced by the best of its foragers sent out as scouts, so
    that every cycle has equally many evaluations.

    Attributes:
        box: to search.
        settings: of the colony.
        sites: the population, best first.
        trace: all evaluations.
    """

    def __init__(
        self,
        box: Box,
        settings: BeesSettings | None = None,
        seed: int = 0,
        propose: Propose | None = None,
        start: Array | None = None,
    ) -> None:
        """Prepares a search; nothing is evaluated yet.

        Args:
            box: to search.
            settings: of the colony.
            seed: of all its random numbers.
            propose: chooses points in place of scouts.
            start: (k, p) points that are known to be good, among the first ones.
        """
        self._start = np.zeros((0, box.size)) if start is None else box.clip(start)
        self.box, self.settings = box, settings or BeesSettings()
        self.sites: list[Site] = []
        self.trace = Trace()
        self._generator = np.random.default_rng(seed)
        self._propose = propose

    def run(
        self,
        function: BatchFunction,
        cycles: int | None = None,
        stop: Stop | None = None,
        callback: Callable[[Self], None] | None = None,
        checkpoint: Path | None = None,
    ) -> Trace:
        """Searches until a criterion of `stop` is met; called again, it continues.

        Args:
            function: to minimise.
            cycles: in all, counted from the first; a short form of `stop`.
            stop: when to end.
            callback: called after every cycle.
            checkpoint: file that holds the search after every cycle; if it is there
                already, the search goes on from it, bit for bit.

        Raises:
            DisasmError: the checkpoint is of another search.
        """
        stop = stop or Stop(cycles=cycles)
        if checkpoint and checkpoint.exists():
            self._resume(checkpoint)
        while not (reason := self._reason(stop)):
            self._cycle(function)
            if checkpoint:
                self.save(checkpoint)
            if callback:
                callback(self)
        self.trace.stopped = reason
        return self.trace

    def save(self, path: Path) -> None:
        """Writes the whole search to a file, or nothing."""
        write_json(path, self.state(), indent=None)

    def state(self) -> dict[str, Any]:
        """Returns the whole search as plain data, of which JSON keeps every bit."""
        sites = [
            {**asdict(s), "centre": s.centre.tolist(), "edge": s.edge.tolist()}
            for s in self.sites
        ]
        return {
            **self._identity(),
            "sites": sites,
            "trace": self.trace.to_mapping(),
            "generator": self._generator.bit_generator.state,
        }

    def restore(self, state: Mapping[str, Any]) -> None:
        """Restores what `state` returned.

        Raises:
            DisasmError: it is of another box or colony.
        """
        for key, value in self._identity().items():
            if state.get(key) != value:
                raise DisasmError(
                    f"bees: the checkpoint has other {key}; resume with the same, or "
                    "name another file"
                )
        self.sites = [
            Site(np.array(s["centre"]), s["value"], np.array(s["edge"]), s["lives"])
            for s in state["sites"]
        ]
        self.trace = Trace.from_mapping(state["trace"])
        vectors = [s.centre for s in self.sites] + [s.edge for s in self.sites]
        if {v.shape for v in (*vectors, *self.trace.points)} - {(self.box.size,)}:
            raise ValueError("points of another size")
        self._generator.bit_generator.state = state["generator"]

    def _resume(self, path: Path) -> None:
        """Restores the search that a file holds."""
        state = read_json(path, _REMEDY, _STATE)
        try:
            self.restore(state)
        except (ValueError, TypeError, LookupError) as error:  # NumPy's generator's
            raise DisasmError(
                f"{path}: is damaged ({clipped(str(error))}); {_REMEDY}"
            ) from None

    def _identity(self) -> dict[str, Any]:
        bounds = [self.box.low.tolist(), self.box.high.tolist()]
        return {"bounds": bounds, "settings": asdict(self.settings)}

    def _reason(self, stop: Stop) -> str:
        """Returns why to stop now; an empty text to go on."""
        done, trace = len(self.trace.cycle_ends) - 1, self.trace
        if stop.cycles is not None and done >= stop.cycles:
            return f"{stop.cycles} cycles"
        next_one = trace.evaluations + self.settings.per_cycle
        if stop.evaluations is not None and next_one > stop.evaluations:
            return f"budget of {stop.evaluations} evaluations"
        if trace.values and trace.best_value <= stop.value:
            return f"value {stop.value:g} reached"
        if stop.stagnation and done > stop.stagnation:
            then = trace.cycle_ends[-1 - stop.stagnation]
            if min(trace.values[:then]) <= trace.best_value:
                return f"no progress in {stop.stagnation} cycles"
        return ""

    def _cycle(self, function: BatchFunction) -> None:
        """Does lines 1 and 2 of algorithm 4.1 at first, then lines 3 to 10."""
        if self.sites:
            self._search(function)
        else:
            points = self._scouts(self.settings.initial)
            points[: len(self._start)] = self._start[: len(points)]
            self.sites = [self._site(x, f) for x, f in self._evaluate(function, points)]
        self.sites.sort(key=lambda site: site.value)
        del self.sites[self.settings.sites :]
        self.sites[0].lives = self.settings.stagnation_limit
        self.trace.cycle_ends.append(self.trace.evaluations)

    def _search(self, function: BatchFunction) -> None:
        """Sends out foragers and scouts at once, and updates the population."""
        groups = [self._foragers(rank) for rank in range(len(self.sites))]
        groups.append(self._scouts(self.settings.scouts))
        ends = np.cumsum([len(group) for group in groups])
        found = self._evaluate(function, np.concatenate(groups))
        starts = [0, *ends[:-1]]
        sites = [
            self._after_search(site, found[a:b])
            for site, a, b in zip(self.sites, starts, ends, strict=False)
        ]
        self.sites = sites + [self._site(x, f) for x, f in found[starts[-1] :]]

    def _foragers(self, rank: int) -> Array:
        """Returns points (nr, p) around a site; anywhere, if it has no life left."""
        site, count = self.sites[rank], self.settings.foragers(rank)
        if site.lives == 0:
            return self.box.sample(count, self._generator)
        offsets = self._generator.uniform(-0.5, 0.5, (count, self.box.size))
        return self.box.clip(site.centre + offsets * site.edge)

    def _scouts(self, count: int) -> Array:
        if self._propose and self.trace.evaluations and count:
            return self._propose(self.trace, self.box, count, self._generator)
        return self.box.sample(count, self._generator)

    def _after_search(self, site: Site, found: Sequence[tuple[Array, float]]) -> Site:
        """Returns the site updated by its foragers' points and values."""
        x, value = min(found, key=lambda pair: pair[1])
        if site.lives == 0:
            return self._site(x, value)
        if value < site.value:
            return Site(x, value, site.edge, site.lives)
        return Site(
            site.centre, site.value, site.edge * self.settings.shrink, site.lives - 1
        )

    def _site(self, x: Array, value: float) -> Site:
        edge = self.settings.neighbourhood * self.box.width
        return Site(x, value, edge, self.settings.stagnation_limit)

    def _evaluate(
        self, function: BatchFunction, points: Array
    ) -> list[tuple[Array, float]]:
        values = np.asarray(function(points), dtype=float)
        self.trace.add(points, values)
        return list(zip(points, values.tolist(), strict=True))
