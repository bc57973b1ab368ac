"""A crane whose load is seen by a camera five times a second, while the drive takes a command every 10 ms."""

import control

from replication.estimation import dualrate

A = [[0, 1, 0, 0], [0, -1, 2, 0], [0, 0, 0, 1], [0, 1, -6, -0.2]]  # cart and load: positions and speeds
loop = dualrate.design(control.ss(A, [[0], [1], [0], [-1]], [[1, 0, 1, 0]], 0), period=0.01, ratio=20)
print(loop)
print({name: round(radius, 4) for name, radius in dualrate.compare(loop).items()})
observer = loop.observer()
for k in range(40):
    command = loop.gains["K"] @ observer.estimate
    observer.step(command, [0.3] if k % 20 == 0 else None)  # the camera speaks at every twentieth step
figure = loop.plot()
