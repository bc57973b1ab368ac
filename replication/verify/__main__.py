"""`python -m replication.verify [PATH...]`."""

from replication.verify.run import main

if __name__ == "__main__":
    raise SystemExit(main())
