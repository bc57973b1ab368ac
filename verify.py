"""Check the certificates with python-flint only: `python verify.py [PATH...]`."""

from replication.verify.run import main

raise SystemExit(main())
