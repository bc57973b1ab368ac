"""A tank whose level is measured 0.8 s late and with noise; a pump, which is known, fills it through the same pipe."""

from replication.estimation import delay

tank = delay.DelayPlant(
    [[-0.2]], [0.8], b=[[1, 0]], c10=[[1]], c2=[[0]], c2_delayed=[[[1]]], d21=[[0, 0.5]], b_u_delayed=[[[1]]]
)
print(delay.limit(tank))  # what no observer can do better
best = delay.design(tank, margin=0.02)
print(best)
observer = best.observer(dt=0.02)
for level in (0.0, 0.1, 0.2, None, 0.3):  # None: the measurement was lost
    print(observer.step(1.0, level))
