"""A note on an epidemic."""

from papers.epidemic import claims, experiments, figures
from replication.audit.declare import experiment, paper
from replication.audit.inspect.coverage import tallies

PAPER = paper(
    key="epidemic",
    title="A note on an epidemic",
    authors=("A. Author",),
    year=2031,
    venue="Made up",
    doi="",
    summary="Growth, doubling time and final size of an epidemic.",
    bibtex="@misc{epidemic, title = {A note on an epidemic}}",
    parts=(claims.SETTING, claims.RESULTS),
    experiments=(
        experiment("epidemic", experiments.epidemic, reproduction=claims.REPRODUCTION, days=claims.DAYS, step=0.01),
    ),
    errata=claims.ERRATA,
    figures=(figures.COURSE,),
    coverage=tallies(__file__),
)
