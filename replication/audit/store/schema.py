"""The text of docs/results.schema.json, which `python -m replication.audit.store.schema` prints."""

from __future__ import annotations

import json
import sys

from replication.audit.store.records import json_schema


def schema_text() -> str:
    """The JSON Schema of results.json as published: two spaces, one newline at the end."""
    return json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"


if __name__ == "__main__":
    sys.stdout.write(schema_text())
