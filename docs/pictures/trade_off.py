"""Between the least worst case and the least mean error: the first part of the way is nearly free."""

import numpy as np

from replication.drawing.panels import draw
from replication.estimation import multirate

cart = multirate.MultiratePlant(
    A=[[1.0, 0.1], [0.0, 0.98]], B_d=[[0.0], [0.1]], C=[[0.0, 1.0], [1.0, 0.0]], D=np.diag([0.5, 0.1])
)
curve = multirate.design(cart, periods=(1, 4)).tradeoff(24)
slopes = np.diff(curve.rms) / np.diff(curve.gain)
assert slopes[0] < 3 * slopes[-2] < 0  # what the text says of the first part of the way
figure = draw(curve.panels())
