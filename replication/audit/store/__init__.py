"""What a run writes and reads back: results and their schema, cache, checksums of sources, provenance."""
