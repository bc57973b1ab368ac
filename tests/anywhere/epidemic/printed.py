"""What the note prints."""

from replication.audit.data import read_printed

DATA = read_printed(__file__)
