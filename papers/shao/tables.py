"""Table I in its own shape, and the formulas that the report shows."""

from papers.shao import data
from replication.audit.model import Formula, Table

TABLES = (
    Table(
        place="Table I",
        caption="Largest tracking error over the amplitude of the reference, percent",
        header=("Reference", "SRC", "DRC-PMI", "DRC-APO"),
        rows=tuple(
            (reference, *(f"claim:shao.table.{short}-{index + 1}" for short in ("src", "pmi", "apo")))
            for index, reference in enumerate(data.REFERENCES)
        ),
    ),
)
FORMULAS = (
    Formula(
        text="The observer between fast instants, with a measured or a virtual output",
        latex=r"\dot{\zeta}(t) = (A - LC)\zeta(t) + B u(t_k) + L \bar{y}(t_k)",
    ),
    Formula(
        text="The virtual measurement (6) as printed",
        latex=r"y_p(t_k) = C\left(\bar{A}\zeta(t_{k-1}) + \bar{B}u(t_{k-1})\right)",
    ),
    Formula(
        text="The repaired virtual measurement, restarted at each true one",
        latex=r"y_p(t_k) = \bar{y}(t_{k-1}) + C\left((\bar{A} - I)\zeta(t_{k-1}) + \bar{B}u(t_{k-1})\right)",
    ),
    Formula(
        text="The error of the virtual measurement (6), which does not vanish as T goes to zero",
        latex=r"y_p(t_k) - y(t_k) = -C e^{AT}\xi(t_{k-1})",
    ),
)
