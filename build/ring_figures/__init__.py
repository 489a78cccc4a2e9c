"""The dissertation's figures of the ring model, chapters 5 and 6, from our own solutions."""
