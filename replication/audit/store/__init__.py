"""What a run writes and reads back: records, cache, hashes of sources, provenance."""
