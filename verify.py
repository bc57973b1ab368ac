"""Check the certificates with python-flint only: `python verify.py [--both] [--jobs N] [PATH...]`."""

from replication.twice import main

# A process that checks some of them may import this file again.
if __name__ == "__main__":
    raise SystemExit(main())
