"""H-infinity filters for nonuniformly sampled measurements: design, guarantees for every sampling sequence,
brackets."""
