"""The observer of a delay plant: gains on the present innovation, as data.

With the plant as lines (`LineForm`), x^ and psi^_i follow

    x^'(t) = [A_0 x^ + sum_i (end_i psi^_i(-1) + sum_c moments_i[c] mu^_ic)]_x + L_0 eps(t) + known inputs,
    d psi^_i / dt = (1/tau_i) d psi^_i / ds + L_i(s) eps(t),    psi^_i(0, t) = E_x,i x^(t),    -1 <= s <= 0,
    eps(t) = y(t) - [C_2 x^ + sum_i (end_i psi^_i(-1) + sum_c moments_i[c] mu^_ic)]_y,
    z^(t) = [C_10 x^ + sum_i (end_i psi^_i(-1) + sum_c moments_i[c] mu^_ic)]_z + L_z eps(t),

so that psi^_i(s, t) = E_x,i x^(t + s tau_i) + integral over 0 <= a <= -s tau_i of L_i(s + a / tau_i) eps(t - a): a
delay equation for x^ with finite memory of the innovation; no history of y is kept. The errors e = x - x^ and psi_i -
psi^_i follow the same equations with B w for the known inputs, -L_0 eps, -L_i eps, and psi_i(0) = E_i [e; w]; then
eps is C_2 e + .. + D_21 w, and the error of z is C_10 e + .. + D_11 w - L_z eps.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from replication.estimation.delay.general.lines import LineForm
from replication.estimation.delay.general.plant import DelayPlant
from replication.estimation.delay.sos import legendre
from replication.estimation.validation import Array


@dataclass(frozen=True)
class DelayObserver:
    """The gains of an observer, in the units of the plant.

    Attributes
    ----------
    plant : DelayPlant
        Whose known inputs the observer copies.
    form : LineForm
        The same plant as lines.
    l0 : array (n, q)
        L_0, in 1/s.
    lz : array (p, q)
        L_z.
    kernels : tuple of arrays (c, m, q)
        For each line the Legendre coefficients of the polynomial L_i(s) over -1 <= s <= 0, in 1/s.
    """

    plant: DelayPlant
    form: LineForm
    l0: Array
    lz: Array
    kernels: tuple[Array, ...]

    def kernel(self, line: int, points: Array) -> Array:
        """L_i at points of [-1, 0].

        Parameters
        ----------
        line : int
            i, from zero.
        points : array (M,)
            Points s.

        Returns
        -------
        array (M, m, q)
            In 1/s.
        """
        coefficients = self.kernels[line]
        return np.asarray(np.tensordot(legendre.evaluate(len(coefficients), points), coefficients, axes=1))
