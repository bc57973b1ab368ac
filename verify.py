"""Check the certificates with python-flint only: `python verify.py [--both] [PATH...]`."""

from replication.twice import main

raise SystemExit(main())
