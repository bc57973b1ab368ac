"""The longer the delay, the more an observer that carries the history is worth."""

import numpy as np

from replication.drawing.panels import Panel, draw
from replication.estimation import delay

delays = np.array([0.2, 0.4, 0.6, 0.8, 1.0, 1.2])
loops = [  # the second state acts on the first again after the delay; the first is measured
    delay.delay_system([[-1, 0], [1, -1]], [[[0, -2], [0, 0]]], [tau], b=np.eye(2), c10=[[0, 1]], c2=[[1, 0]])
    for tau in delays
]
levels = np.array([delay.design(loop, margin=0.02).value for loop in loops])
told = [{one.what: one.value for one in delay.analyse(loop).evidence} for loop in loops]
alone = np.array([one["gain from w to z"] for one in told])
assert np.all(np.diff(alone / levels) > 0)  # what the caption says
lines = {"this observer": levels, "no sensor": alone}
figure = draw([Panel(delays, "delay (s)", "gain", lines, {})])
