"""The more the periods vary, the more is lost by a filter that was designed at one of them."""

import numpy as np

from replication.drawing.panels import Panel, draw
from replication.estimation import nonuniform

arm = nonuniform.SampledPlant(  # a flexible arm: its position is measured, its speed estimated
    A=[[0.0, 1.0], [-4.0, -0.4]], B=[[0.0, 0.0], [1.0, 0.0]], C=[[1.0, 0.0]], D=[[0.0, 0.1]], L=[[0.0, 1.0]]
)
longest = np.array([0.4, 0.8, 1.2])
one, whole = (
    [nonuniform.design(arm, periods=(0.3, end), goal=goal, leaves=2, horizon=horizon) for end in longest]
    for goal, horizon in (("nominal", 200), ("robust", 20))  # only of the first are lower ends of brackets needed
)
zero = nonuniform.Filter([[0.0]], [[0.0]], [[0.0]])
none = [nonuniform.analyse(arm, zero, periods=(0.3, end), leaves=4, horizon=20) for end in longest]
# What the text says of the widest range.
assert one[-1].bracket.lower > none[-1].value and none[-1].bracket.lower > whole[-1].value
lines = {
    "designed at the middle": np.array([design.value for design in one]),
    "designed for the range": np.array([design.value for design in whole]),
    "no sensor": np.array([result.value for result in none]),
}
figure = draw([Panel(longest, "longest period (s); the shortest is 0.3 s", "gain", lines, {})])
