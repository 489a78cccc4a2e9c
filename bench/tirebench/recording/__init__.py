"""Recordings of a line: written first, read again, repaired, replayed and exported."""
