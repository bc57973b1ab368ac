"""What the manuscript prints, as strings: motor, gains, rates, reference frequencies and Table I.

The values are those of a simulation study; they are not measurements of a motor.
"""

from __future__ import annotations

RESISTANCE = "0.54"
"""R in Ω."""
FLUX = "0.61"
"""Ψ_f in Wb."""
INDUCTANCE = "0.0096"
"""L_q in H."""
POLE_PAIRS = "4"
FRICTION = "0.0001"
"""B_ω in N m s/rad."""
INERTIA = "0.016"
"""J in kg m²."""
TORQUE_CONSTANT = "3.66"
"""K_T in N m/A."""

START = ("-0.5", "1", "-1")
"""x(0) in rad, rad/s, rad/s²."""
PERIOD = "0.2"
"""T = T_c in s."""
RATIO = "5"
"""M."""
SLOW_PERIOD = "1"
"""T_s in s."""
FEEDBACK = ("-20", "-0.1", "-0.01")
INJECTION = ("0.45", "0.9", "0.9")

FREQUENCIES = ("0.5", "1", "1.5", "2", "2.5", "3")
"""σ of the rows sin(t/2), sin(t), sin(3t/2), sin(2t), sin(5t/2), sin(3t) of Table I, rad/s."""
REFERENCES = ("sin(t/2)", "sin(t)", "sin(3t/2)", "sin(2t)", "sin(5t/2)", "sin(3t)")
TABLE_PMI = ("11.38", "13.89", "18.21", "24.73", "33.85", "42.03")
"""Column DRC-PMI of Table I, percent."""
TABLE_APO = ("1.02", "2.93", "5.42", "9.91", "16.73", "25.92")
"""Column DRC-APO of Table I, percent."""
FIGURE_FREQUENCIES = ("0.5", "1.5")
"""σ of Figs. 2 and 3, rad/s."""
