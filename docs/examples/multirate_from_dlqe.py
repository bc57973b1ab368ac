"""The Kalman filter of python-control is the same here; with a slower camera it is one line more."""

import control
import numpy as np

from replication.estimation import multirate

A, G, C = np.array([[1.0, 0.1], [0.0, 0.98]]), np.array([[0.0], [0.1]]), np.array([[0.0, 1.0], [1.0, 0.0]])
Q, R = np.eye(1), np.diag([0.25, 0.01])
cart = control.ss(A, G, C, 0, 0.1)
same = multirate.design(cart, periods=(1, 1), goal="h2", Q=Q, R=R)  # each sensor at each step

slow = multirate.design(cart, periods=(1, 4), goal="h2", Q=Q, R=R)  # the camera at each fourth
print("as dlqe:", np.allclose(control.dlqe(A, G, C, Q, R)[0], same.gains["L"][0]), f"level, slower: {slow.value:.4f}")
best = multirate.design(cart, periods=(1, 4), Q=Q, R=R)  # the smallest worst case instead
print(f"guaranteed level: {best.value:.4f}, bracket: [{best.bracket.lower:.4f}, {best.bracket.upper:.4f}]")
