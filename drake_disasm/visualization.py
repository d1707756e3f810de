"""Watching the task in Meshcat, live and as a page that plays offline."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from pydrake.geometry import (
    Cylinder,
    Meshcat,
    MeshcatParams,
    MeshcatVisualizer,
    MeshcatVisualizerParams,
    Rgba,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.meshcat import ContactVisualizer, ContactVisualizerParams
from pydrake.systems.framework import (
    Context,
    DiagramBuilder,
    EventStatus,
    LeafSystem,
    OutputPort,
)

from drake_disasm.common.errors import DisasmError
from drake_disasm.common.files import make_folder, write_text
from drake_disasm.common.spatial import pose_from_vector
from drake_disasm.common.stopwatch import Stopwatch
from drake_disasm.stations.base import Station
from drake_disasm.stations.measured_cell import MeasuredCell, measured_ports
from drake_disasm.task.diagram import TaskSystems

_FRAME_PERIOD = 1.0 / 32.0  # s
_NEWTONS_PER_METRE = 150.0  # of the wrench arrow's length
_NEWTON_METRES_PER_METRE = 5.0
_CONTACT_NEWTONS_PER_METRE = 1000.0  # the pads press with 60 N
_FORCE, _TORQUE = Rgba(0.85, 0.1, 0.1), Rgba(0.1, 0.3, 0.9)
_PATH = Rgba(0.05, 0.55, 0.15)


def start_meshcat(host: str = "localhost") -> Meshcat:
    """Returns Drake's Meshcat server on a free port from 7000 on.

    Args:
        host: address to listen on; "*" for every interface.

    Raises:
        DisasmError: it can't listen there.
    """
    try:
        return Meshcat(MeshcatParams(host=host, show_stats_plot=False))
    except RuntimeError as error:
        raise DisasmError(f"Meshcat can't listen on {host}: {error}") from None


class MeshcatView:
    """Shows robot, lock, contact forces, the wrench on the bolt and its path.

    Connect it to the task's systems before their diagram is built, or give it to a
    TaskSimulation as an observer. A station without a simulated plant is shown as it
    is measured, without contact forces.

    Args:
        meshcat: the server.
        record: whether to keep every frame for `save_html`.
        close_up: whether to look at the groove rather than at the whole cell.
    """

    def __init__(
        self, meshcat: Meshcat, record: bool = False, close_up: bool = False
    ) -> None:
        self.meshcat, self.records, self._close_up = meshcat, record, close_up

    def connect(self, builder: DiagramBuilder, systems: TaskSystems) -> None:
        """Adds Drake's visualisers and the wrench's."""
        station, stopwatch = systems.station, Stopwatch()
        station.register_part("view", stopwatch)
        builder.AddNamedSystem("view_begins", EachFrame(stopwatch.start))
        query = add_cell_view(builder, station, self.meshcat, self._close_up)
        if station.HasOutputPort("contact_results"):
            self._add_contact(builder, station.GetOutputPort("contact_results"), query)
        self.wrench = builder.AddNamedSystem(
            "wrench_visualizer", WrenchVisualizer(self.meshcat, station.X_WG)
        )
        for port in ("observation", "X_GB"):
            builder.Connect(
                systems.processor.GetOutputPort(port), self.wrench.GetInputPort(port)
            )
        builder.AddNamedSystem("view_ends", EachFrame(stopwatch.stop))

    def _add_contact(
        self, builder: DiagramBuilder, results: OutputPort, query: OutputPort
    ) -> None:
        ContactVisualizer.AddToBuilder(
            builder,
            results,
            query,
            self.meshcat,
            ContactVisualizerParams(
                newtons_per_meter=_CONTACT_NEWTONS_PER_METRE,
                newton_meters_per_meter=_NEWTON_METRES_PER_METRE,
                force_threshold=0.1,
                moment_threshold=0.1,
                radius=0.0008,
            ),
        )

    def begin_episode(self) -> None:
        """Clears the path; starts recording if asked to."""
        self.wrench.clear()
        if self.records:
            self.meshcat.DeleteRecording()
            self.meshcat.StartRecording(frames_per_second=1.0 / _FRAME_PERIOD)

    def end_episode(self) -> None:
        """Publishes the recording, so that the page has a time slider."""
        if self.records:
            self.meshcat.StopRecording()
            self.meshcat.PublishRecording()

    def save_html(self, path: Path) -> None:
        """Writes a page that plays the recording without a server.

        Raises:
            DisasmError: it can't be written there.
        """
        make_folder(path.parent)
        write_text(path, self.meshcat.StaticHtml())


class MeasuredView:
    """Shows arm and fingers as the devices measure them; simulates nothing.

    Args:
        meshcat: the server.
        station: whose cell it is.
        close_up: whether to look at the groove rather than at the whole cell.
    """

    def __init__(
        self, meshcat: Meshcat, station: Station, close_up: bool = False
    ) -> None:
        builder = DiagramBuilder()
        self._ports = measured_ports(station.scenario)
        self._cell = builder.AddNamedSystem(
            "measured_cell", MeasuredCell(station.scenario)
        )
        _add_geometry(builder, self._cell.GetOutputPort("query_object"), meshcat)
        self._diagram = builder.Build()
        self._context = self._diagram.CreateDefaultContext()
        _look_at(meshcat, station.X_WG, close_up)

    def show(self, measured: Mapping[str, np.ndarray]) -> None:
        """Draws one frame, if all of it is finite.

        Args:
            measured: by port, `measured_ports` at least: angles (n,) [rad], opening and
                its rate (2,) [m, m/s].
        """
        values = [measured[name] for name in self._ports]
        if not all(np.isfinite(value).all() for value in values):
            return
        cell_context = self._cell.GetMyContextFromRoot(self._context)
        for name, value in zip(self._ports, values, strict=True):
            self._cell.GetInputPort(name).FixValue(cell_context, value)
        self._diagram.ForcedPublish(self._context)


def add_cell_view(
    builder: DiagramBuilder, station: Station, meshcat: Meshcat, close_up: bool = False
) -> OutputPort:
    """Shows a station's cell in Meshcat, a real one as its devices measure it.

    Args:
        builder: of the diagram that holds the station.
        station: whose cell it is.
        meshcat: the server.
        close_up: whether to look at the groove rather than at the whole cell.

    Returns:
        The query port of what is shown.
    """
    if station.HasOutputPort("query_object"):
        query = station.GetOutputPort("query_object")
    else:
        query = _measured_geometry(builder, station)
    _add_geometry(builder, query, meshcat)
    _look_at(meshcat, station.X_WG, close_up)
    return query


def _measured_geometry(builder: DiagramBuilder, station: Station) -> OutputPort:
    """Returns the query port of a station's cell, posed by its measurements."""
    cell = builder.AddNamedSystem("measured_cell", MeasuredCell(station.scenario))
    for port in measured_ports(station.scenario):
        builder.Connect(station.GetOutputPort(port), cell.GetInputPort(port))
    return cell.GetOutputPort("query_object")


def _add_geometry(builder: DiagramBuilder, query: OutputPort, meshcat: Meshcat) -> None:
    params = MeshcatVisualizerParams(publish_period=_FRAME_PERIOD)
    MeshcatVisualizer.AddToBuilder(builder, query, meshcat, params)


def _look_at(meshcat: Meshcat, X_WG: RigidTransform, close_up: bool) -> None:
    """Points the camera at arm and lock, or at the groove alone."""
    A = X_WG.translation()
    meshcat.SetProperty("/Background", "top_color", [0.82, 0.88, 0.94])
    meshcat.SetProperty("/Background", "bottom_color", [0.97, 0.98, 0.99])
    if close_up:
        eye, target = [0.115, -0.055, 0.055], [0.025, 0.0, 0.025]
    else:
        eye, target = [0.50, -0.68, 0.40], [-0.22, 0.0, 0.16]
    meshcat.SetCameraPose(A + np.array(eye), A + np.array(target))


class EachFrame(LeafSystem):
    """Calls a function at each frame, in its place among the systems of a diagram.

    @system
    name: EachFrame
    input_ports: []
    output_ports: []
    @endsystem

    Args:
        call: is called.
    """

    def __init__(self, call: Callable[[], None]) -> None:
        super().__init__()
        self._call = call
        self.DeclarePeriodicPublishEvent(_FRAME_PERIOD, 0.0, self._publish)

    def _publish(self, context: Context) -> EventStatus:
        self._call()
        return EventStatus.Succeeded()


class WrenchVisualizer(LeafSystem):
    """Draws the wrench on the bolt as two arrows, and the path of Bo.

    @system
    name: WrenchVisualizer
    input_ports:
    - observation
    - X_GB
    @endsystem

    Args:
        meshcat: where to draw.
        X_WG: the groove's nominal frame.
    """

    def __init__(self, meshcat: Meshcat, X_WG: RigidTransform) -> None:
        super().__init__()
        self._meshcat, self._X_WG = meshcat, X_WG
        self._path: list[np.ndarray] = []
        self._observation = self.DeclareVectorInputPort("observation", 12)
        self._pose = self.DeclareVectorInputPort("X_GB", 7)
        self.DeclarePeriodicPublishEvent(_FRAME_PERIOD, 0.0, self._publish)
        for name, color in (("force", _FORCE), ("torque", _TORQUE)):
            meshcat.SetObject(f"wrench/{name}", Cylinder(0.002, 1.0), color)

    def clear(self) -> None:
        """Clears the path so far."""
        self._path = []
        self._meshcat.Delete("path")

    def _publish(self, context: Context) -> EventStatus:
        X_GB = pose_from_vector(self._pose.Eval(context))
        p_WB = self._X_WG @ X_GB.translation()
        R_WG = self._X_WG.rotation().matrix()
        wrench = self._observation.Eval(context)[6:]
        time = context.get_time()
        self._draw("force", p_WB, R_WG @ wrench[:3] / _NEWTONS_PER_METRE, time)
        self._draw("torque", p_WB, R_WG @ wrench[3:] / _NEWTON_METRES_PER_METRE, time)
        self._path.append(p_WB)
        if len(self._path) > 1:
            self._meshcat.SetLine("path", np.array(self._path).T, 3.0, _PATH)
        return EventStatus.Succeeded()

    def _draw(
        self, name: str, p_WB: np.ndarray, arrow_W: np.ndarray, time: float
    ) -> None:
        """Stretches the cylinder `name` from the bolt along the arrow."""
        length = float(np.linalg.norm(arrow_W))
        visible = length > 1e-3
        self._meshcat.SetProperty(f"wrench/{name}", "visible", visible, time)
        if not visible:
            return
        R = RotationMatrix.MakeFromOneVector(arrow_W / length, axis_index=2)
        X_WArrow = RigidTransform(R, p_WB + arrow_W / 2)
        self._meshcat.SetTransform(f"wrench/{name}", X_WArrow, time)
        self._meshcat.SetProperty(
            f"wrench/{name}/<object>", "scale", [1.0, length, 1.0], time
        )
