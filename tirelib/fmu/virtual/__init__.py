"""A tire in place of a vehicle's wheel: load and slip in, strain frames of five gages out."""
