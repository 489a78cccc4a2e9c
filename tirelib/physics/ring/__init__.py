"""The flexible ring: how the belt answers loads from the road."""
