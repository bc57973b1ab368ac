"""Temperature of a stirred reactor, sampled every 2 to 6 s, whenever the bus is free; the coolant is not measured."""

from replication.estimation import nonuniform

reactor = nonuniform.SampledPlant(
    A=[[-0.20, 0.05], [0.0, -0.10]], B=[[0.0, 0.0], [0.10, 0.0]], C=[[1.0, 0.0]], D=[[0.0, 0.2]], L=[[0.0, 1.0]]
)
robust = nonuniform.design(reactor, periods=(2.0, 6.0), leaves=4, horizon=100)
nominal = nonuniform.design(reactor, periods=(2.0, 6.0), leaves=4, horizon=100, goal="nominal")
print(robust)
print("designed for 4 s only:", nominal.bracket)
worst = nonuniform.simulate(robust)  # the worst sampling sequence that was found, and its disturbance
print(worst.ratio, worst.time[-1])
figure = worst.plot()
