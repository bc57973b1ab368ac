"""The experiments of the toy paper that need nothing but arithmetic."""

from papers.toy2020.lengthy import wait
from papers.toy2020.spectra import spectrum
from papers.toy2020.squares import square
from replication.audit.model import Experiment

EXPERIMENTS = (
    Experiment(name="toy2020.square", function=square, inputs={"values": (1.0, 2.0, 0.1)}),
    Experiment(name="toy2020.spectrum", function=spectrum, inputs={"size": 200, "seed": 1}),
    Experiment(name="toy2020.wait-a", function=wait, inputs={"seconds": 0.0, "label": "a"}),
    Experiment(name="toy2020.wait-b", function=wait, inputs={"seconds": 0.0, "label": "b"}),
)
