"""The current form of an observer: the measurement of an instant enters the estimate of the same instant.

The printed order is the predictor form, ζ(k+1) = F ζ(k) + G u(k) + H ȳ(k) with x̂(k) = ζ(k): a measurement acts one fast
period later. In the current form x̂(k) = ζ(k) + H ȳ(k) and ζ(k+1) = F x̂(k) + G u(k); with a discrete gain this is the
textbook current observer x̂(k) = ζ(k) + L (ȳ(k) − C ζ(k)), ζ(k+1) = Ā x̂(k) + B̄ u(k).
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from replication.estimation.dualrate.observers import Builder, Observer, ObserverStep
from replication.estimation.dualrate.sampled import SampledModel, without_correction


def current(builder: Builder, *, discrete_gain: bool = False) -> Builder:
    """A builder of the current form of what `builder` builds; `discrete_gain` as in `close_loop`."""
    return partial(_build, builder, discrete_gain)


def _build(builder: Builder, discrete_gain: bool, model: SampledModel) -> Observer:
    predictor = builder(model)
    free = builder(without_correction(model, discrete_gain=discrete_gain))
    steps = tuple(_current_step(step, bare) for step, bare in zip(predictor.steps, free.steps, strict=True))
    return replace(predictor, steps=steps)


def _current_step(step: ObserverStep, bare: ObserverStep) -> ObserverStep:
    """Correct first, then move on without correction: what a step has beyond the bare one is the correction."""
    correction, reading = step.transition - bare.transition, step.injection - bare.injection
    corrected = np.eye(len(correction)) + correction
    return ObserverStep(
        transition=bare.transition @ corrected,
        input=bare.input,
        injection=bare.transition @ reading + bare.injection,
        forcing=bare.forcing,
        readout=step.readout @ corrected,
        feedthrough=step.feedthrough + step.readout @ reading,
    )
