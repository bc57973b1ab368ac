"""The more the periods vary, the more is lost by a filter that was designed at one of them."""

import numpy as np

from replication.drawing.panel import Panel
from replication.drawing.panels import draw
from replication.estimation import nonuniform

reactor = nonuniform.SampledPlant(
    A=[[-0.20, 0.05], [0.0, -0.10]], B=[[0.0, 0.0], [0.10, 0.0]], C=[[1.0, 0.0]], D=[[0.0, 0.2]], L=[[0.0, 1.0]]
)
longest = np.array([3.0, 4.5, 6.0, 9.0, 12.0])
levels = {
    goal: np.array(
        [nonuniform.design(reactor, periods=(2.0, end), goal=goal, leaves=4, horizon=60).value for end in longest]
    )
    for goal in ("nominal", "robust")
}
without = nonuniform.design(reactor, periods=(2.0, 3.0), goal="nominal").fact("level without sensors").value
assert levels["nominal"][-1] > levels["robust"][-1]  # what the caption says, at the widest range
lines = {"designed at the middle": levels["nominal"], "designed for the range": levels["robust"]}
figure = draw([Panel(longest, "longest period (s); the shortest is 2 s", "gain", lines, {"no sensor:": without})])
