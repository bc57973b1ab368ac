"""A note on an epidemic."""

from papers.epidemic import errata, experiments, figures, printed
from replication.audit.declare import Part, experiment, number, paper
from replication.audit.numbers import numbers
from replication.audit.project import about

NUMBERS = numbers(__file__)
R, DAYS = (number(printed.DATA[name]) for name in ("reproduction", "days"))

PAPER = paper(
    **about(__file__),
    parts=(Part("Sec. 2", reason="Parameters."), *NUMBERS.parts, Part("The course", figures="course")),
    experiments=(
        experiment("epidemic", experiments.epidemic, reproduction=R, days=DAYS, step=0.01),
        experiment("closed", experiments.closed, reproduction=R, days=DAYS),
    ),
    errata=errata.ERRATA,
    figures=(figures.COURSE,),
)
