"""What each committed certificate proves is pinned: sentence, bounds, truth, all that it exports as data, and by how
many obligations: a proof that leaves one out says the same.

`python tests/verify/test_said.py` writes the pins anew; a change of one is a change of what is proved.
"""

import json
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from replication import twice
from replication.verify import kernel
from replication.verify.theorem import require

ROOT = Path(__file__).parents[2]
PINS = Path(__file__).with_name("said.json")
PATHS = {f"{path.parent.name}/{path.stem}": path for path in sorted((ROOT / "certificates").rglob("*.json"))}


def said(name: str) -> dict[str, Any]:
    with patch.object(kernel, "require", wraps=require) as settled:
        (found,) = twice.said([PATHS[name]], ROOT, 1)
    assert found["proved"], found["line"]
    told = {key: value for key, value in json.loads(json.dumps(found)).items() if key not in ("line", "proved")}
    return {**told, "obligations": settled.call_count}


@cache
def pins() -> dict[str, dict[str, Any]]:
    return json.loads(PINS.read_text(encoding="utf-8"))  # type: ignore[no-any-return]


def test_every_certificate_is_pinned() -> None:
    assert pins().keys() == PATHS.keys()


@pytest.mark.parametrize("name", PATHS)
def test_what_is_proved_is_as_pinned(name: str) -> None:
    assert said(name) == pins()[name]


if __name__ == "__main__":
    lines = (f"{json.dumps(name)}: {json.dumps(said(name), ensure_ascii=False, sort_keys=True)}" for name in PATHS)
    PINS.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
