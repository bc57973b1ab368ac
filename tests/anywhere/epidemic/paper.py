"""A note on an epidemic."""

from papers.epidemic import errata, experiments, figures, printed
from replication.audit.declare import Part, experiment, paper
from replication.audit.inspect.coverage import tallies
from replication.audit.numbers import numbers

R, DAYS = (float(printed.DATA[name]) for name in ("reproduction", "days"))

PAPER = paper(
    key="epidemic",
    title="A note on an epidemic",
    authors=("A. Author",),
    year=2031,
    venue="Made up",
    doi="",
    summary="Growth, doubling time and final size of an epidemic.",
    bibtex="@misc{epidemic, title = {A note on an epidemic}}",
    parts=(
        Part("Sec. 2", reason="Parameters."),
        *numbers(printed.__file__),
        Part("The course", figures="course"),
    ),
    experiments=(
        experiment("epidemic", experiments.epidemic, reproduction=R, days=DAYS, step=0.01),
        experiment("closed", experiments.closed, reproduction=R, days=DAYS),
    ),
    errata=errata.ERRATA,
    figures=(figures.COURSE,),
    coverage=tallies(__file__),
)
