"""Records a diagnosis: its report, and a Meshcat page of each experiment.

A simulated cell whose sensor warms up, asked by two experiments about two effects.
`make docs` runs it, once: `python docs/_ext/recorded_diagnosis.py FOLDER`.
"""

import dataclasses
import shutil
import sys
import tempfile
from pathlib import Path

from drake_disasm.common.files import make_folder, write_text
from drake_disasm.common.program import provenance
from drake_disasm.effects import SensorDrift, SensorWarmUp
from drake_disasm.experiments import Presses, Rest
from drake_disasm.scenario import load_scenario
from drake_disasm.visualization import MeshcatView, start_meshcat
from sysid.diagnosis import diagnose
from sysid.report import diagnosis_page


def main(folder: Path) -> None:
    """Writes the report and its pages into a folder."""
    with tempfile.TemporaryDirectory() as name:
        _diagnose(Path(name))
        make_folder(folder)
        for own in ("meshcat", "report.html"):  # the last is what make looks for
            shutil.move(Path(name) / own, folder / own)


def _diagnose(folder: Path) -> None:
    model = load_scenario("removal", ["contact.model=impact"])
    hidden = SensorWarmUp(fz=2.0, time_constant=15.0)
    contact = dataclasses.replace(model.contact, model="hydroelastic")
    real = dataclasses.replace(model, contact=contact, effects=[hidden])
    found = diagnose(
        model,
        folder,
        real=real,
        experiments=(Presses, Rest),
        effects=(SensorDrift, SensorWarmUp),
        view=MeshcatView(start_meshcat(), record=True),
    )
    origin = provenance("docs/_ext/recorded_diagnosis.py", sys.argv[1:], 0)
    write_text(folder / "report.html", diagnosis_page(found, origin, is_watched=True))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
