"""A log that grows: what it keeps of each experiment."""

from pathlib import Path

from drake_disasm.experiments import Rest
from drake_disasm.logs import read_log
from drake_disasm.scenario import load_scenario
from drake_disasm.visualization import MeshcatView, start_meshcat
from sysid.diagnosis import GrowingLog

IMPACT = load_scenario("removal", ["contact.model=impact"])


def test_each_experiment_is_an_episode_and_may_be_a_page(tmp_path: Path) -> None:
    view = MeshcatView(start_meshcat(), record=True)
    log = GrowingLog(IMPACT, tmp_path / "log", "twin", view=view)
    performed = log.perform(Rest(1.0).plan(IMPACT))
    assert log.episodes == 1 and performed.ended == ""
    page = (tmp_path / "meshcat/episode_0000.html").read_text()
    assert "<html" in page and "animation" in page.lower()
    again = GrowingLog(IMPACT, tmp_path / "log", "twin")
    again.perform(Rest(2.0).plan(IMPACT))
    lengths = [len(e.columns["time"]) for e in read_log(tmp_path / "log").episodes]
    assert lengths[1] - lengths[0] == 10
