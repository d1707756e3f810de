"""LeafSystems between station and policy."""
