"""Check the certificates, without any package: `python verify.py [--both | --arithmetic NAME] [--jobs N] [PATH...]`."""

from replication.twice import main

# A process that checks some of them may import this file again.
if __name__ == "__main__":
    raise SystemExit(main())
