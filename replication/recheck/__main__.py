"""`python -m replication.recheck FILE...`: the second verifier alone, with the standard library only."""

import sys
from pathlib import Path

from replication.recheck.run import report

raise SystemExit(report(list(map(Path, sys.argv[1:]))))
