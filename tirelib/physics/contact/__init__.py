"""Contact of the ring with a flat road."""
