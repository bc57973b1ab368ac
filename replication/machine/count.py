"""How many lines a reader must trust for one theorem: `python -m replication.machine.count [PAPER NAME]`.

Lines that hold more than comments, of the statement, of the paper's decimals and of the theorem itself.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

from replication.machine.generate import proposition
from replication.machine.run import wanted
from replication.machine.theory import THEORY

ROOT = Path(__file__).parents[2]


def lines(text: str) -> int:
    """Lines of a file of Coq without comments and empty lines."""
    return sum(bool(line.strip()) for line in re.sub(r"\(\*.*?\*\)", "", text, flags=re.DOTALL).splitlines())


def counted(paper: str, name: str, root: Path = ROOT) -> str:
    """The count, as it is printed."""
    entry = wanted(paper, root)[name]
    bound = json.loads((root / "certificates" / paper / f"{name}.json").read_text(encoding="utf-8"))["bound"]
    asked = {"statement": entry.statement, "plant": entry.plant, "parameters": entry.parameters}
    decimals = root / "papers" / paper / "coq" / "Decimals.v"
    parts = {
        "replication/machine/multirate/Statement.v": lines((THEORY / "Statement.v").read_text(encoding="utf-8")),
        f"papers/{paper}/coq/Decimals.v": lines(decimals.read_text(encoding="utf-8")),
        f"the theorem {name}": lines(proposition(asked, bound)),
    }
    return "".join(f"{count:5} {what}\n" for what, count in parts.items())


if __name__ == "__main__":
    chosen_paper, chosen_name = sys.argv[1:] or ("okajima2023", "gains-38")
    sys.stdout.write(counted(chosen_paper, chosen_name))
