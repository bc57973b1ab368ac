"""What a paper's certificates must be about: its wanted theorems, and its plants from the printed strings.

The plants are made here once more, from printed.toml; those of ours, which no paper prints, are read off the literal
`OWN` of papers/peet2019/plants.py without running it.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Callable, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

from replication.recheck.exact import scaled, unit
from replication.recheck.reading import Matrix, Unproved, decoded, need, several, take, word

ROOT = Path(__file__).resolve().parents[2]
DECIMAL = re.compile(r"-?\d*\.?\d+", re.ASCII)

Plant = dict[str, Any]


def wanted(paper: str, name: str, root: Path) -> Plant:
    """The fields of a wanted theorem's certificate, but for bound and witness."""
    folder = root / "papers" / paper
    need((folder / "theorems.json").is_file(), f"there is no paper {paper!r:.60} that lists theorems")
    entries = several(decoded((folder / "theorems.json").read_bytes()), "theorems.json", lambda entry, _: entry)
    found = [entry for entry in entries if entry.get("name") == name]
    need(len(found) == 1, f"the paper {paper} wants {len(found)} theorems named {name!r:.60}")
    _, claims, statement, plant, parameters = take(found[0], name, "name", "claims", "statement", "plant", "parameters")
    described: Plant = {"name": word(plant, "plant")}
    if plant:
        need(paper in PLANTS, f"the plants of {paper} are not known here")
        made = PLANTS[paper](printed(folder / "printed.toml"), folder)
        need(plant in made, f"the paper {paper} has no plant {plant}")
        described |= written(made[plant])
    return {"claims": claims, "statement": statement, "plant": described, "parameters": parameters}


def printed(path: Path) -> Mapping[str, Any]:
    """The printed values by name, without a float."""

    def no_float(text: str) -> Any:
        need(False, f"printed.toml holds the float {text}")

    return {
        name: table["value"] for name, table in tomllib.loads(path.read_text("utf-8"), parse_float=no_float).items()
    }


def written(value: Any) -> Any:
    """Rationals as the strings that stand in certificates."""
    if isinstance(value, Mapping):
        return {key: written(entry) for key, entry in value.items()}
    return [written(entry) for entry in value] if isinstance(value, list) else str(value)


def decimal(text: str) -> Fraction:
    """A printed decimal."""
    need(DECIMAL.fullmatch(text) is not None, f"{text!r} is no decimal")
    return Fraction(text)


def table(text: str) -> Matrix:
    """A printed matrix, "[1 2; 3 4]"."""
    need(text.startswith("[") and text.endswith("]"), f"{text!r} is no matrix")
    return [[decimal(entry) for entry in row.split()] for row in text[1:-1].split(";")]


def column(entries: list[str]) -> Matrix:
    """A column of decimals."""
    return [[decimal(entry)] for entry in entries]


def okajima(data: Mapping[str, Any], _: Path) -> dict[str, Plant]:
    """The plant of Sec. IV-A, alone and with the printed gains, and that of Sec. IV-C with its poles."""
    stable: Plant = {name: table(data["plant"][name]) for name in ("A", "B_d", "C", "D")} | {"W": unit(3)}
    gains = {equation: [table(text) for text in texts] for equation, texts in data["gains"].items()}
    poles = data["poles"]
    places = max(len(digits) for digits in re.findall(r"\.(\d+)", poles))
    return {
        "stable": stable,
        **{f"gains-{one}": {**stable, "L": gains[one]} for one in ("33", "38", "39", "40")},
        "section-4c": {
            "A": table(data["unstable-A"]),
            "C": stable["C"],
            "L": gains["42"],
            "poles": [_pole(text) for text in poles.strip("()").split(",")],
            "half_unit": Fraction(1, 2 * 10**places),
            "error_poles": [decimal(text.strip()) for text in data["error-poles"].strip("()").split(",")],
        },
    }


def _pole(text: str) -> list[Fraction]:
    real, _, imaginary = text.strip().partition("±")
    return [decimal(real), decimal(imaginary.removesuffix("i")) if imaginary else Fraction(0)]


def mustafa(data: Mapping[str, Any], folder: Path) -> dict[str, Plant]:
    """Both examples, times as a + b pi, and the second one with the printed filter."""
    first, second = (_matrices(data[f"example-{i}"]) for i in (1, 2))
    b, inertia, k, resistance, inductance = (decimal(data[name]) for name in ("b", "J", "K", "R_a", "L_a"))
    nought = Fraction(0)
    first |= {"h_l": [decimal(data["h_l-1"]), nought], "h_u": [nought, 1 / decimal(data["h_u-1-divisor"])]}
    second |= {end: [decimal(data[f"{end}-2"]), nought] for end in ("h_l", "h_u")}
    second["A"] = [[-b / inertia, k / inertia], [-k / inductance, -resistance / inductance]]
    given = {name: table(data["filter"][f"{name}_f"]) for name in "ABC"}
    ours = _evaluated(_assigned(folder, "OUR_FILTER"))
    filtered = {"our-filter": {**first, "filter": ours}, "printed-filter": {**second, "filter": given}}
    return {"example-1": first, "example-2": second, **filtered}


def _assigned(folder: Path, name: str) -> ast.expr:
    """The expression that stands for a name in plants.py, which is not run."""
    for node in ast.parse((folder / "plants.py").read_text("utf-8")).body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", node)]
        value = getattr(node, "value", None)
        if isinstance(value, ast.expr) and name in map(ast.unparse, targets):
            return value
    raise Unproved(f"plants.py has no {name}")


def _evaluated(node: ast.expr) -> Any:
    """The fractions of a literal, by name and by rows: integers, powers, signs and what makes numbers of them."""
    match node:
        case ast.Constant(value=int(number)):
            return Fraction(number)
        case ast.UnaryOp(op=ast.USub(), operand=inner):
            return -_evaluated(inner)
        case ast.BinOp(op=ast.Pow(), left=base, right=ast.Constant(value=int(power))):
            return _evaluated(base) ** power
        case ast.List(elts=entries):
            return [_evaluated(entry) for entry in entries]
        case ast.Dict(keys=keys, values=values):
            return {ast.literal_eval(key): _evaluated(value) for key, value in zip(keys, values, strict=True) if key}
        case ast.Call(func=ast.Name(id="fmpq"), args=[above, below]):
            return _evaluated(above) / _evaluated(below)
        case ast.Call(func=ast.Name(id="fmpq_mat"), args=[rows]):
            return _evaluated(rows)
    raise Unproved(f"plants.py has {ast.unparse(node)} where numbers are")


def _matrices(data: Mapping[str, str]) -> Plant:
    return {name: table(text if name != "D" else f"[{text}]") for name, text in data.items()}


def peet(data: Mapping[str, Any], folder: Path) -> dict[str, Plant]:
    """Examples 1 to 3, the same with one disturbance, and the literal ones of ours."""
    found = {}
    for example in "123":
        given = data[f"example-{example}"]
        number = len(given["delays"])
        delayed = scaled(Fraction(1, number), table(given["a"]))
        found[f"ex{example}"] = _delayed(given, [delayed] * number)
        found[f"ex{example}-single"] = {**found[f"ex{example}"], "B": [[Fraction(1)]] * len(delayed)}
    own = _assigned(folder, "OWN")
    return found | {name: _delayed(one, list(map(table, one["a"]))) for name, one in ast.literal_eval(own).items()}


def _delayed(given: Mapping[str, Any], delayed: list[Matrix]) -> Plant:
    output = table(given["c10"])
    none = [scaled(0, output) for _ in delayed]
    return {
        "A0": table(given["a0"]),
        "A": delayed,
        "delays": [decimal(text) for text in given["delays"]],
        "B": table(given["b"]),
        "C10": output,
        "C1": list(map(table, given["c1"])) if "c1" in given else none,
        "C2": table(given["c2"]),
    }


def shao(data: Mapping[str, Any], _: Path) -> dict[str, Plant]:
    """The motor by its parameters, its loop, the same with a start, and a scalar loop of ours."""
    names = ("resistance", "flux", "inductance", "pole_pairs", "friction", "inertia", "torque_constant")
    r, psi, l_q, p, b_w, j, k_t = values = [decimal(data[name]) for name in names]
    nought, one = Fraction(0), Fraction(1)
    matrices: Plant = {
        "A": [
            [nought, one, nought],
            [nought, nought, one],
            [nought, -(r * b_w + k_t * p * psi) / (j * l_q), -r / l_q - b_w / j],
        ],
        "B": [[nought], [nought], [k_t / (j * l_q)]],
        "C": [[one, nought, nought]],
    }
    rates = {"T": decimal(data["period"]), "M": decimal(data["ratio"])}
    loop = {**matrices, "K": [[decimal(text) for text in data["feedback"]]], "L": column(data["injection"]), **rates}
    scalar = {"A": [[one]], "B": [[one]], "C": [[one]], "K": [[-2 * one]], "L": [[2 * one]], "T": Fraction(1, 1000)}
    return {
        "parameters": {**dict(zip(("R", "Psi", "Lq", "p", "Bw", "J", "KT"), values, strict=True)), **matrices},
        "motor": loop,
        "motor-from-start": {**loop, "start": column(data["start"])},
        "scalar": {**scalar, "M": Fraction(5)},
        **{f"scalar-{ratio}": {**scalar, "M": Fraction(ratio)} for ratio in (1005, 1006)},
    }


PLANTS: dict[str, Callable[[Mapping[str, Any], Path], dict[str, Plant]]] = {
    "mustafa": mustafa,
    "okajima2023": okajima,
    "peet2019": peet,
    "shao": shao,
}
"""By paper, what makes its plants of what is printed."""
