"""What the toy paper says."""

from typing import Any

from replication.audit.model import Claim, Erratum, Evidence, Kind, Proof, Results, Verdict
from replication.audit.parts import Figure, FigureData


def two_squared(results: Results) -> Evidence:
    return Evidence(method="multiplication", value=results["square"]["squares"][1])


def patient(results: Results) -> Evidence:
    return Evidence(method="waiting", holds=results["wait-a"]["waited"] == "a", margin=1.0)


def misprint(results: Results) -> Proof:
    return Proof(holds=True, text="It must be a square.", quantities={"four": results["square"]["squares"][1]})


def points(results: Results) -> FigureData:
    return FigureData(columns={"x": (1.0, 2.0), "square": tuple(results["square"]["squares"][:2])})


def draw(data: FigureData) -> Any:
    from matplotlib.figure import Figure as Drawing

    drawing = Drawing()
    drawing.subplots().plot(data.columns["x"], data.columns["square"])
    return drawing


CLAIMS = (
    Claim(
        reading="none",
        id="toy2020.square.two",
        place="Table 1",
        kind=Kind.VALUE,
        statement="Two squared.",
        expected=Verdict.REPRODUCED,
        answer=two_squared,
        printed="4.0",
    ),
    Claim(
        reading="none",
        id="toy2020.square.wrong",
        place="Table 2",
        kind=Kind.VALUE,
        statement="Two squared, misprinted.",
        expected=Verdict.DIFFERS,
        answer=two_squared,
        printed="4.1",
    ),
    Claim(
        reading="none",
        id="toy2020.wait.patient",
        place="Sec. 2",
        kind=Kind.ORDER,
        statement="Waiting ends.",
        expected=Verdict.CONSISTENT,
        answer=patient,
    ),
)
ERRATA = (
    Erratum(
        id="toy2020.power",
        place="eq. (1)",
        printed="x",
        meant="x²",
        prove=misprint,
    ),
)
FIGURES = (
    Figure(
        name="toy2020-fig1",
        place="Fig. 1",
        title="Squares",
        caption="Squares over their roots.",
        published=True,
        uses=("toy2020.square",),
        data=points,
        plot=draw,
        alt=lambda data: f"From {data.columns['square'][0]} to {data.columns['square'][-1]}.",
    ),
)
