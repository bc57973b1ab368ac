"""Samples that are lost in a row: what gains guarantee that know nothing of it, and gains that count the losses."""

import numpy as np

from replication.drawing.panels import Panel, draw
from replication.errors import InfeasibleError
from replication.estimation import multirate
from replication.estimation.multirate import losses

cart = multirate.MultiratePlant(
    A=[[1.0, 0.1], [0.0, 0.98]], B_d=[[0.0], [0.1]], C=[[0.0, 1.0], [1.0, 0.0]], D=np.diag([0.5, 0.1])
)
best = multirate.design(cart, periods=(1, 4))
most = np.arange(5)


def level(work, count: int) -> float:
    """Proved for all patterns; not a number where one of them makes the error grow."""
    try:
        return work(best, losses.InARow(count)).value
    except InfeasibleError:
        return np.nan


lines = {
    "gains that know nothing of losses": np.array([level(losses.analyse, int(m)) for m in most]),
    "gains that count them": np.array([level(losses.design, int(m)) for m in most]),
}
unaware, counting = lines.values()
assert np.isnan(unaware[-1]) and np.all(counting[1:4] < unaware[1:4])  # what the text says
figure = draw([Panel(most, "losses in a row, at most", "guaranteed level", lines, {})])
